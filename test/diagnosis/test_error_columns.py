# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What speaks against an answer stands at its top, and its errors are the same everywhere."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import lg_husky_sim as lg
from lg_husky_sim.api.diagnosing import DiagnosisResult
from lg_husky_sim.cli.terminal import marked
from lg_husky_sim.diagnosis.decision.strain import Strained, strained
from lg_husky_sim.diagnosis.error_tables import error_tables, with_details
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.model_mismatch import model_mismatch
from lg_husky_sim.diagnosis.output import summary_text
from lg_husky_sim.diagnosis.report import report_data
from lg_husky_sim.diagnosis.result import Diagnosis, diagnosis_data, Finding, Verdict
from lg_husky_sim.diagnosis.sensors.robot import Difference
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.reporting.data import ErrorRow
import numpy as np
import pytest

FOUND = Finding('torque_ripple', 'left', 'drivetrain', ('J_LW',), 'while driving', None, (),
                800.0, 1e-9, 0.9, (), 'A sentence.')
DAMPING = Strained('wheel_damping', 'N·m·s/rad', 1.3, 19.5, 0.0952, 10.5, 2.26)
SIDES = Strained('side_gain_ratio', '1', 1.0, 1.0051, 0.9961, 1.0039, 2.55)
MASS = Strained('mass', 'kg', 48.0, 58.0, 0.907, 1.10, 3.8, at_bound=True)


def _diagnosis(*findings: Finding, **changes: Any) -> Diagnosis:
    plain = load_model()
    model = replace(plain, parameters=plain.parameters.replacing({'mass': 49.0}))
    verdict = Verdict.KNOWN if findings else Verdict.NOTHING_MISSING
    bare = Diagnosis(verdict, 0.93, findings, (), (), (), {}, {}, {}, {}, '', model, plain)
    return replace(bare, **changes)


@pytest.mark.parametrize(('plain', 'final', 'words'), [
    ((DAMPING,), (DAMPING, MASS),
     'the recalibrated model with the finding is implausible beside its nominal: wheel damping '
     '×15 (tolerance ×0.0952 to ×10.5), mass ×1.21 (tolerance ×0.907 to ×1.1, at its bound);'),
    ((DAMPING,), (SIDES,), ': side gain ratio ×1.005 (tolerance ×0.9961 to ×1.004);'),
    ((DAMPING,), (), ''), ((), (), '')])
def test_implausible_parameters_are_said_first_everywhere(
        plain: tuple[Strained, ...], final: tuple[Strained, ...], words: str) -> None:
    said = _diagnosis(FOUND, strained_plain=plain, strained=final)
    assert len(said.warnings) == bool(words)
    for warning in said.warnings:
        assert words in warning
        assert summary_text(said).splitlines()[1] == f'  warning: {warning}'
        assert report_data(said, ['rec'], [], []).headline.warnings == (
            f'{warning[0].upper()}{warning[1:]}.',)
    data = diagnosis_data(said)
    assert data['warnings'] == list(said.warnings)
    assert [one['name'] for one in data['implausible']['plain']] == [one.name for one in plain]
    for one in data['implausible']['augmented']:
        assert one['factor'] == pytest.approx(one['value'] / one['nominal'])
    assert replace(said, fits=False).warnings == ()


def test_implausible_parameters_without_a_finding_are_said_once() -> None:
    said = _diagnosis(strained_plain=(DAMPING,), strained=(DAMPING,))
    (warning,) = said.warnings
    assert warning.count('wheel damping') == 1
    assert 'finding' not in warning


@pytest.mark.parametrize(('changes', 'names'), [
    ({}, []), ({'wheel_damping': 4.0}, []), ({'wheel_damping': 1.3016 * 15.0}, []),
    ({'mass': 48.39 * 1.12}, []), ({'wheel_damping': 1.3016 * 40.0}, ['wheel_damping']),
    ({'mass': 48.39 * 1.2, 'yaw_damping': 12.865 / 17.0}, ['mass', 'yaw_damping']),
    ({'track': 10.0}, ['track'])])
def test_strained_are_those_outside_their_priors(changes: dict[str, float], names: list[str]
                                                 ) -> None:
    """Dampings, which nobody knows, may move much further than a mass; one of many may be off."""
    parameters = load_model().parameters
    unknowns = [one for one in base_unknowns(parameters, ()) if one.kind == 'model']
    values = {**parameters, **changes}
    place = np.array([one.place(values[one.name]) for one in unknowns])
    residuals = np.array([(at - one.centre) / one.deviation
                          for at, one in zip(place, unknowns, strict=True)])
    fit = SimpleNamespace(point=SimpleNamespace(
        unknowns=unknowns, places=place, prior_residuals=residuals, numbers=parameters))
    found = strained(fit)  # type: ignore[arg-type]
    assert [one.name for one in found] == names
    for one in found:
        assert one.factor == pytest.approx(values[one.name] / parameters[one.name])
        assert not one.least <= one.factor <= one.most
        assert one.at_bound == (one.name == 'track')
        assert np.log([one.factor, one.most / one.least]) == pytest.approx(
            np.log(one.most) * np.array([one.deviations / setting('two_sided'), 2.0]))
        if one.name == 'mass':
            assert one.most == pytest.approx(1.05 ** 1.96, rel=0.01)


ERRORS = {'position_rmse_m': 1.86, 'wheel_speed_rmse': 0.843, 'max_abs_x_m': 3.24}


def _measured() -> Diagnosis:
    return _diagnosis(
        FOUND, held_out_nominal={**ERRORS, 'position_rmse_m': 3.0},
        held_out_plain=ERRORS, nominal=ERRORS, plain=ERRORS, augmented=ERRORS,
        held_out_augmented={**ERRORS, 'wheel_speed_rmse': 0.231, 'max_abs_x_m': 6.48})


def test_text_has_three_columns_and_marks_losses_as_it_marks_gains() -> None:
    lines = summary_text(_measured()).splitlines()
    place = next(k for k, line in enumerate(lines) if 'nominal' in line)
    assert lines[place].split() == ['held-out', 'data', 'nominal', 'recalibrated', 'with',
                                    'finding', 'change']
    said = {line.split('[')[0].strip(): line.split(']')[1].split()
            for line in lines[place + 1:place + 4]}
    assert said['position'] == ['3.00', '1.86', '1.86', '+0', '%']
    assert said['wheel rate'] == ['0.843', '0.843', '0.231', '−73', '%', 'better']
    assert said['largest |X| error'] == ['3.24', '3.24', '6.48', '+100', '%', 'worse']
    assert '  change: from recalibrated to with finding' in lines
    assert max(map(len, lines[place:place + 9])) <= 80
    data = diagnosis_data(_measured())['fit']
    assert data['held_out']['nominal']['position_rmse_m'] == 3.0
    assert data['nominal']['wheel_speed_rmse'] == 0.843


def test_page_text_and_notebook_have_the_same_errors() -> None:
    common = error_tables(_measured())
    (row,) = (one for one in common[1].rows if one.name.startswith('wheel'))
    traced = replace(common[1], note='by blocks', rows=(
        ErrorRow('left wheel rate [rad/s]', {'recalibrated': 1.0}),
        ErrorRow(row.name, {'recalibrated': 77.0}, 0.5, 0.6)))
    held_out, everything, other = with_details(
        common, [traced, replace(traced, title='Recording rec')])
    assert held_out == common[0]
    assert other.title == 'Recording rec'
    rows = {one.name: one for one in everything.rows}
    assert rows[row.name].values == row.values
    assert (rows[row.name].low, everything.note) == (0.5, 'by blocks')
    assert set(rows) == {'left wheel rate [rad/s]', *(one.name for one in common[1].rows)}
    case: Any = SimpleNamespace(diagnosis=_measured())
    shown = DiagnosisResult(case, (), lg.Husky()).errors()
    assert shown.columns == ('held-out data', *common[0].columns, 'change')
    assert [list(one[1:-1]) for one in shown.rows] == [
        list(one.values.values()) for one in common[0].rows]
    assert [one[-1].split()[-1] for one in shown.rows if isinstance(one[-1], str)] == [
        '%', 'better', 'worse']


def test_one_model_alone_has_no_change() -> None:
    case: Any = SimpleNamespace(diagnosis=replace(
        _diagnosis(fits=False), nominal={**ERRORS, 'wheel_speed_rmse': float('nan')},
        plain=ERRORS, held_out_nominal=ERRORS, held_out_plain=ERRORS))
    for held_out, count in ((True, 3), (False, 2)):
        shown = DiagnosisResult(case, (), lg.Husky()).errors(held_out)
        assert 'change' not in shown.columns
        assert {len(row) for row in shown.rows} == {len(shown.columns)} == {2}
        assert len(shown.rows) == count


def test_a_model_to_which_nothing_was_added_has_no_column_of_its_own() -> None:
    said = replace(_measured(), findings=())
    assert {one.columns for one in error_tables(said)} == {('nominal', 'recalibrated')}
    lines = summary_text(said).splitlines()
    assert '  change: from nominal to recalibrated' in lines
    assert error_tables(replace(said, held_out_plain={}, plain={})) == ()


def test_gains_and_losses_are_coloured_in_a_terminal() -> None:
    shown = marked(summary_text(_measured()))
    styles = {shown.plain[one.start:one.end].split()[-1]: one.style for one in shown.spans}
    assert styles == {'better': 'bold green', 'worse': 'bold red'} | (
        {'warning:': 'bold red'} if _measured().warnings else {})


def test_all_that_differs_is_said_in_sentences_of_its_own() -> None:
    nothing: Any = None
    said = model_mismatch(
        [Difference('traction', (), 'everywhere', words, 9.0, comparable=False)
         for words in ('There is no ground reaction. It is lifted', 'its wheels are large')],
        {}, (), (), nothing, (), nothing).finding.statement
    assert said == 'There is no ground reaction. It is lifted. Its wheels are large.'
