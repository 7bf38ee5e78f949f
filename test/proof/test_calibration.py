# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Coefficients of the confidence follow from outcomes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lg_husky_sim.cli.main import run
from lg_husky_sim.diagnosis.decision import confidence
from lg_husky_sim.diagnosis.result import Verdict
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.proof import calibration, outcomes
from lg_husky_sim.proof.calibration import calibrated
import numpy as np
import pytest


def line(name: str, right: bool, **features: Any) -> dict[str, Any]:
    """Return the outcome of a slope that was called right or wrong."""
    said = 'slope' if right else 'payload'
    true = {'effect': 'slope', 'in_list': True, 'severity': 'medium', 'side': 'both',
            'form': '', 'size': 1.0, 'related_answers': [], 'onset': None,
            'subsystem': 'translation'}
    return {'case': name, 'kind': 'single', 'level': 'clear', 'world': 'w', 'regime': {},
            'unseen': [], 'nats': [], 'true': [true], 'verdict': 'known', 'confidence': 0.9,
            'said': [{'effect': said, 'side': 'both', 'subsystem': 'translation',
                      'onset': {'kind': 'none'}, 'gain': 50.0, 'rivals': []}],
            'groups': [], 'failed': '', 'held_out': [], 'held_out_failed': '', 'seconds': 1.0,
            'features': features}


def lines(count: int) -> list[dict[str, Any]]:
    """Return outcomes that are right the oftener the more their name gains."""
    rng = np.random.default_rng(2)
    gains = rng.uniform(1.0, 4.0, count)
    return [line(f'c{i}', bool(rng.uniform() < g / 4.0), gain=10.0 ** g, share=0.1, chance=1e-9,
                 readings=100)
            for i, g in enumerate(gains)]


def test_a_gain_that_informs_gets_weight_and_the_share_right_is_kept() -> None:
    rows = lines(400)
    found = calibrated(rows)
    constant, share, gain = (found[n][0] for n in ('name_constant', 'name_share', 'name_gain'))
    assert gain > 0.5
    stated = [1.0 / (1.0 + np.exp(-(constant + share * np.log(0.1)
                                    + gain * np.log10(r['features']['gain'])))) for r in rows]
    assert np.mean(stated) == pytest.approx(found['name_gain'][2] / 400, abs=0.02)
    assert found['name_gain'][1] == 400
    assert found['unknown_constant'][1] == 0


def test_slopes_that_are_kept_leave_the_constant_to_fit() -> None:
    """Fewer outcomes that are right lower the constant alone, to the share that is right."""
    slopes = {'name_share': -0.4, 'name_gain': 0.8}
    found = calibrated(lines(400), slopes)
    assert {name: found[name][0] for name in slopes} == slopes
    constant = found['name_constant'][0]
    stated = [1.0 / (1.0 + np.exp(-(constant - 0.4 * np.log(0.1)
                                    + 0.8 * np.log10(r['features']['gain'])))) for r in lines(400)]
    assert np.mean(stated) == pytest.approx(found['name_constant'][2] / 400, abs=0.02)


def test_a_share_that_informs_gets_weight() -> None:
    """Outcomes that are wrong the oftener the more a smooth effort explains."""
    rng = np.random.default_rng(5)
    rows = [line(f'c{i}', bool(rng.uniform() > s), gain=30.0, share=s, chance=1e-9,
                 readings=100)
            for i, s in enumerate(rng.uniform(0.02, 1.0, 400))]
    assert calibrated(rows)['name_share'][0] < -0.5


def test_the_weakest_name_counts_where_the_first_was_written_down() -> None:
    """Earlier versions wrote the gain of the first name, and the margin to the next."""
    rows = lines(100)
    weak = [{**row, 'features': {**row['features'], 'gain': 1e6, 'margin': 0.5},
             'said': [{**row['said'][0], 'gain': gain}
                      for gain in (1e6, row['features']['gain'])]} for row in rows]
    answers = [name for names in calibration.COEFFICIENTS.values() for name in names
               if not name.startswith('real_')]
    found, expected = calibrated(weak), calibrated(rows)
    assert [found[name] for name in answers] == [expected[name] for name in answers]


def test_changes_have_coefficients_of_their_own() -> None:
    """The less probable their gain is by chance, the oftener these are right."""
    rng = np.random.default_rng(4)

    def outcome(i: int, decades: float) -> dict[str, Any]:
        right = bool(rng.uniform() < 1.0 / (1.0 + np.exp(0.5 + 0.4 * decades)))
        return {**line(f'c{i}', right, gain=9.0, chance=10.0 ** decades), 'kind': 'before_after'}
    found = calibrated([outcome(i, d) for i, d in enumerate(rng.uniform(-9.0, -2.0, 600))])
    assert found['change_chance'][0] == pytest.approx(-0.4, abs=0.15)
    assert found['change_constant'][1] == 600
    assert found['name_constant'][1] == found['unchanged_constant'][1] == 0
    same = {**line('same', True, gain=0.0, chance=0.5), 'kind': 'before_after',
            'verdict': 'nothing_missing', 'said': [], 'true': [], 'level': 'clean'}
    assert calibrated([same])['unchanged_constant'][1:] == (1, 1)


def test_names_beside_a_right_one_and_of_clean_robots_tell_how_large_real_ones_are() -> None:
    """Those in the place of another name do not: they say nothing of its size."""
    rng = np.random.default_rng(7)
    features = {'share': 0.1, 'chance': 1e-9, 'gain': 1.0, 'readings': 20000}

    def outcome(i: int, decades: float) -> dict[str, Any]:
        right = bool(rng.uniform() < 1.0 / (1.0 + np.exp(-3.0 * (2.0 + decades))))
        whole = line(f'c{i}', True, **features)
        first, gain = whole['said'][0], 0.5 * 20000 * 10.0 ** decades
        if right:
            return {**whole, 'said': [{**first, 'gain': gain}]}
        return {**whole, 'kind': 'none', 'level': 'clean', 'true': [],
                'said': [{**first, 'gain': gain}]}
    rows = [outcome(i, d) for i, d in enumerate(rng.uniform(-4.0, 0.0, 500))]
    constant, part, told = (calibrated(rows)[name] for name in (
        'real_constant', 'real_translation', 'real_told'))
    assert -(constant[0] + part[0]) / told[0] == pytest.approx(-2.0, abs=0.2)
    assert told[0] > 2.0
    assert constant[1] == 500
    wrong = [line(f'w{i}', False, **features) for i in range(50)]
    assert calibrated([*rows, *wrong])['real_told'] == told
    extra = line('two', True, **features)
    extra = {**extra, 'said': [*extra['said'], {**extra['said'][0], 'effect': 'payload'}]}
    assert calibrated([*rows, extra])['real_told'][1:] == (502, told[2] + 1)


def test_a_part_whose_names_are_oftener_real_gets_weight() -> None:
    rng = np.random.default_rng(8)
    features = {'share': 0.1, 'chance': 1e-9, 'gain': 1.0, 'readings': 20000}

    def outcome(i: int) -> dict[str, Any]:
        effect, often = (('gyro_bias', 0.9), ('command_slew', 0.2))[i % 2]
        whole = line(f'c{i}', True, **features)
        said = [{**whole['said'][0], 'effect': effect}]
        if rng.uniform() < often:
            return {**whole, 'true': [{**whole['true'][0], 'effect': effect}], 'said': said}
        return {**whole, 'kind': 'none', 'level': 'clean', 'true': [], 'said': said}
    found = calibrated([outcome(i) for i in range(400)])
    told = np.log(9.0) - np.log(0.25)
    assert found['real_sensor'][0] - found['real_command'][0] == pytest.approx(told, abs=0.5)
    assert found['real_traction'][0] == pytest.approx(0.0, abs=0.01)


def test_names_that_would_not_be_said_today_are_left_out_of_earlier_answers() -> None:
    """Without any, something is beyond chance and nothing is said: right of a clean robot."""
    features = {'share': 0.1, 'chance': 1e-9, 'gain': 50.0, 'readings': 40000}
    missed, clean = line('a', True, **features), {
        **line('b', True, **features), 'kind': 'none', 'level': 'clean', 'true': []}
    found = calibrated([missed, *[clean] * 4])
    assert found['nothing_constant'][1:] == (5, 4)
    assert found['name_constant'][1] == 0
    assert found['real_constant'][1:] == (5, 1)
    small = {**missed['said'][0], 'effect': 'payload'}
    both = {**missed, 'said': [{**missed['said'][0], 'gain': 900.0}, small]}
    assert calibrated([both])['name_constant'][1:] == (1, 1)
    alone = {**missed, 'said': both['said'][:1], 'features': {**features, 'gain': 900.0}}
    assert calibrated([both])['name_gain'] == calibrated([alone])['name_gain']


def test_nothing_is_less_sure_where_a_gain_is_beyond_chance() -> None:
    rng = np.random.default_rng(3)

    def outcome(i: int, beyond: bool) -> dict[str, Any]:
        right = bool(rng.uniform() < (0.4 if beyond else 0.9))
        whole = {**line(f'c{i}', right, gain=9.0, chance=1e-5 if beyond else 0.3, share=0.0),
                 'verdict': 'nothing_missing', 'said': []}
        return {**whole, 'kind': 'none', 'level': 'clean', 'true': []} if right else whole
    found = calibrated([outcome(i, i % 3 == 0) for i in range(600)])
    odds = found['nothing_constant'][0], found['nothing_beyond'][0]
    assert 1.0 / (1.0 + np.exp(-odds[0])) == pytest.approx(0.9, abs=0.04)
    assert 1.0 / (1.0 + np.exp(-sum(odds))) == pytest.approx(0.4, abs=0.08)


def test_what_is_called_unlikely_is_what_the_diagnosis_calls_so() -> None:
    for name in ('false_alarm_rate', *calibration.COEFFICIENTS['real']):
        assert calibration._number(name) == setting(name)


def test_few_outcomes_do_not_make_certainty() -> None:
    features = {'gain': 1e4, 'share': 0.0, 'chance': 0.0}
    found = calibrated([line('a', True, **features)])
    assert 1.0 / (1.0 + np.exp(-found['name_constant'][0])) < 0.97
    odds = np.dot([found[name][0] for name in calibration.COEFFICIENTS['known']],
                  calibration._row('known', features))
    assert 1.0 / (1.0 + np.exp(-odds)) < 0.99


@pytest.mark.parametrize(('features', 'named'), [
    ({'gain': 9.0, 'share': 0.1}, 'case bad'),
    ({'gain': 9.0, 'share': None, 'chance': 1.0, 'readings': 100}, 'case bad'),
    ({}, 'no outcome')])
def test_outcomes_without_what_it_needs_are_refused(features: dict[str, Any], named: str) -> None:
    damaged = {**line('bad', True, **features), 'verdict': 'nothing_missing'}
    if features and 'chance' in features:
        damaged['verdict'] = 'known'
    with pytest.raises(LgHuskyError, match=named):
        calibrated([damaged])


def test_command_prints_what_stands_in_the_settings(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / 'outcomes.jsonl'
    outcomes.write(path, {'command': 'c', 'commit': 'x', 'planned': 5, 'seal': '', 'seeds': '-',
                          'set': 'tuning'}, lines(5))
    assert run(['prove', '--from', str(path), '--calibrate']) == 0
    assert 'name_gain: ' in capsys.readouterr().out
    assert run(['prove', '--calibrate']) != 0
    assert '--from' in capsys.readouterr().err


@pytest.mark.parametrize('verdict', list(Verdict))
@pytest.mark.parametrize('value', [0.0, 1e-20, 1e-5, 0.3, 1.0, 40.0])
def test_what_is_fitted_is_what_the_diagnosis_uses(verdict: Verdict, value: float) -> None:
    # The trial shares no code with the diagnosis, so that both say what informs.
    assert calibration.COEFFICIENTS[verdict.value] == confidence.COEFFICIENTS[verdict]
    assert calibration._row(verdict.value, {'share': value, 'chance': value, 'gain': value}) == [
        1.0, *confidence.informs(verdict, confidence.Features(value, value, value))]
