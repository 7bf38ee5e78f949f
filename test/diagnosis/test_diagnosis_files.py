# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The files of a diagnosis, as their user and an outside scorer read them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import html
import json
from pathlib import Path
import re
from typing import Any

import lg_husky_sim as lg
from lg_husky_sim.cli.main import run
from lg_husky_sim.diagnosis.diagnose import _mended, Case
from lg_husky_sim.diagnosis.output import write_files
from lg_husky_sim.diagnosis.report_of_case import new_elements, new_terms
from lg_husky_sim.diagnosis.result import diagnosis_data
from lg_husky_sim.husky.effects import catalogue
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import read_recording, Recording, write_recording
import numpy as np
import pytest

for needed in ('rosbags', 'matplotlib', 'jinja2'):
    pytest.importorskip(needed)

HOSTILE = '<img src=x onerror=alert(1)>'
PARTS = {'command', 'electrical', 'drivetrain', 'traction', 'translation', 'rotation', 'sensor'}
PICTURES = {'before_after.png', 'graph.png', 'effort_1.png'}


@pytest.fixture(scope='module')
def folder(tmp_path_factory: Any, drive: Callable[..., Recording], short: float) -> Path:
    """Return the folder of a diagnosis of a bag with a hostile name, made by the command."""
    place: Path = tmp_path_factory.mktemp('diagnosis')
    made = drive('any', 'rotation', 3, share=short)
    bag = place / HOSTILE
    write_recording(bag, made.streams, frames=('odom', 'base_link'))
    assert run(['diagnose', str(bag), '--jobs', '1', '--out', str(place / 'out')]) == 0
    return place / 'out'


def test_what_reading_mended_is_said_once() -> None:
    one, two = (Recording(name, name, {}, 0, notes=('wheels: sorted', *more))
                for name, more in (('rec1', ()), ('rec2', ('imu: 3 of 9 are not finite',))))
    assert _mended([one, two]) == (
        'rec1, rec2: wheels: sorted', 'rec2: imu: 3 of 9 are not finite')


def test_main_errors_are_there_without_their_channels(
        diagnosed: Callable[[str], Case]) -> None:
    """A recording without a pose, or too short to hold a part out, has them as null."""
    bare = diagnosis_data(replace(diagnosed('nothing').diagnosis, held_out_plain={},
                                  augmented={'yaw_rate_rmse': 0.25}))['fit']
    assert bare['held_out']['plain'] == {
        'position_rmse_m': None, 'yaw_rate_rmse': None, 'wheel_speed_rmse': None}
    assert bare['augmented']['yaw_rate_rmse'] == 0.25


def _number(value: object) -> bool:
    return value is None or (isinstance(value, (int, float)) and not isinstance(value, bool))


def test_json_keeps_to_the_schema(folder: Path) -> None:
    data = json.loads((folder / 'diagnosis.json').read_text(encoding='utf-8'))
    assert data['schema'] == 'lg_husky_sim/diagnosis/1'
    assert data['verdict'] in ('nothing_missing', 'known', 'unknown')
    assert 0.0 <= data['confidence'] <= 1.0
    assert data['findings']
    for finding in data['findings']:
        assert finding['effect'] in {*catalogue(), 'unknown'}
        assert finding['side'] in ('left', 'right', 'both', 'none')
        assert finding['subsystem'] in PARTS
        assert all(isinstance(e, str) for e in finding['elements'])
        assert set(finding['onset']) >= {'kind', 'recording', 'time_s', 'x_m'}
        assert finding['onset']['kind'] in ('none', 'time', 'place')
        for number in finding['parameters']:
            assert set(number) == {'name', 'value', 'unit', 'low', 'high'}
            assert number['low'] <= number['value'] <= number['high']
        assert _number(finding['evidence']['held_out_gain_nats'])
        assert 0.0 <= finding['evidence']['p_value'] <= 1.0
        assert all(r['effect'] in catalogue() for r in finding['rivals'])
        assert finding['statement'].endswith('.')
    for group in data['indistinguishable']:
        assert len(group['effects']) > 1
        assert set(group['separated_by']) == {'sensors', 'manoeuvres'}
    for one in data['mismatch']:
        assert one['recording'] == HOSTILE
        assert one['start_s'] <= one['end_s']
        assert one['subsystem'] in PARTS
    for when in (data['fit'], data['fit']['held_out']):
        for model in ('plain', 'augmented'):
            assert {'position_rmse_m', 'yaw_rate_rmse', 'wheel_speed_rmse'} <= set(when[model])


def test_report_needs_no_other_file_and_escapes_names(folder: Path) -> None:
    page = (folder / 'report.html').read_text(encoding='utf-8')
    assert HOSTILE not in page
    assert html.escape(HOSTILE) in page
    assert not re.search(r'(?:src|href)="(?!data:)', page)
    assert page.count('src="data:image/png;base64,') >= len(PICTURES)


def test_pictures_are_files_too(folder: Path) -> None:
    names = {path.name for path in folder.glob('*.png')}
    assert names >= PICTURES
    assert all(path.read_bytes()[:8] == b'\x89PNG\r\n\x1a\n' for path in folder.glob('*.png'))


def test_the_answer_and_what_to_change_come_before_pictures_and_numbers(folder: Path) -> None:
    page = (folder / 'report.html').read_text(encoding='utf-8')
    statement = json.loads((folder / 'diagnosis.json').read_text(
        encoding='utf-8'))['findings'][0]['statement']
    places = [page.index(words) for words in (
        'Missing effect found: dry scrub of the tyres', html.escape(statement),
        '<dt>Confidence</dt>', '<h2>What to change</h2>', '<figure', '<table>',
        '<h2>Competing effects</h2>', '<h2>Notes</h2>', '<footer>')]
    assert places == sorted(places)
    for column in ('nominal', 'recalibrated', 'with finding'):
        assert f'<th>{column}</th>' in page


def test_the_page_says_what_it_was_made_of(folder: Path) -> None:
    page = (folder / 'report.html').read_text(encoding='utf-8')
    footer = page[page.index('<footer>'):]
    assert f'recording {html.escape(HOSTILE)}' in footer
    assert re.search(r'<code>[0-9a-f]{64}</code>', footer)


def test_model_is_what_simulate_reads(folder: Path, tmp_path: Path) -> None:
    model = load_model(folder / 'model.yaml')
    assert [e.id for e in model.structure.effects] == ['yaw_scrub_coulomb']
    entry = model.parameters.entry('yaw_coulomb_moment')
    assert entry.low is not None
    assert entry.high is not None
    assert entry.low <= entry.value <= entry.high
    for name in ('model', 'plain'):
        assert run(['simulate', '--model', str(folder / f'{name}.yaml'), '--commands', 'spin',
                    '--out', str(tmp_path / name)]) == 0
    model_way, plain_way = (read_recording(tmp_path / n).streams['pose'].values[:, 2]
                            for n in ('model', 'plain'))
    assert np.max(np.abs(model_way - plain_way[:len(model_way)])) > 0.02


def test_same_recordings_same_files_by_more_processes(folder: Path) -> None:
    again = folder.parent / 'again'
    assert run(['diagnose', str(folder.parent / HOSTILE), '--jobs', '2', '--out', str(again)]) == 0
    for path in folder.iterdir():
        assert path.read_bytes() == (again / path.name).read_bytes(), path.name


def test_clean_drive_gives_a_report_without_findings(
        diagnosed: Callable[[str], Case], tmp_path: Path) -> None:
    write_files(tmp_path, diagnosed('nothing'))
    page = (tmp_path / 'report.html').read_text(encoding='utf-8')
    assert 'No missing physics found' in page
    assert 'The finding in numbers' not in page
    assert '<th>with finding</th>' not in page


def test_new_element_stands_in_graph_and_equations(diagnosed: Callable[[str], Case]) -> None:
    case = diagnosed('rotation')
    _, added = new_elements(case.nominal.structure, case.diagnosis.model.structure)
    assert added == ('F_yaw_scrub_coulomb',)
    law, equation = new_terms(case.diagnosis.model, case.nominal.structure)
    assert law.startswith('F_yaw_scrub_coulomb = -(yaw_coulomb_moment)*')
    factor = float(re.findall(r'\+([\d.]+) · F_yaw', equation)[0])
    assert factor == pytest.approx(1.0 / case.diagnosis.model.parameters['yaw_inertia'], rel=1e-3)


def test_no_law_is_shown_with_terms_that_are_zero() -> None:
    nominal = lg.Husky()
    shown = [line for name in catalogue() for line in new_terms(
        nominal.with_effect(name).model, nominal.model.structure)]
    assert any('omega(B_teeth_L)' in line for line in shown)
    assert not [line for line in shown if re.search(r'\b0(\.0)?\)?\*', line)]


def test_a_report_that_cannot_be_made_costs_no_result(
        diagnosed: Callable[[str], Case], tmp_path: Path, monkeypatch: Any) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ValueError('no paper')
    monkeypatch.setattr('lg_husky_sim.diagnosis.output.write_report', broken)
    said = write_files(tmp_path, diagnosed('rotation'))
    assert said == 'report.html could not be made: ValueError: no paper'
    assert {one.name for one in tmp_path.iterdir()} == {
        'diagnosis.json', 'diagnosis.txt', 'model.yaml', 'plain.yaml'}


@pytest.mark.parametrize(('arguments', 'message'), [
    (['nowhere'], 'nowhere'),
    (['{bag}', '--set', 'masss=50'], 'did you mean mass'),
    (['{bag}', '--baseline', 'gone'], 'gone'),
])
def test_bad_input_is_one_line(arguments: list[str], message: str, folder: Path,
                               tmp_path: Path, capsys: Any) -> None:
    given = [a.replace('{bag}', str(folder.parent / HOSTILE)) for a in arguments]
    assert run(['diagnose', *given, '--out', str(tmp_path / 'out')]) == 1
    text = capsys.readouterr().err
    assert text.startswith('error: ')
    assert text.count('\n') == 1
    assert message in text
    assert not (tmp_path / 'out').exists()


def test_results_are_not_written_into_a_recording(folder: Path, capsys: Any) -> None:
    bag = folder.parent / HOSTILE
    before = sorted(bag.iterdir())
    assert run(['diagnose', str(bag), '--out', str(bag)]) == 1
    assert 'is a recording' in capsys.readouterr().err
    assert sorted(bag.iterdir()) == before


@pytest.mark.parametrize('module', ['matplotlib', 'jinja2'])
def test_missing_extra_is_said_before_the_work(module: str, folder: Path, tmp_path: Path,
                                               monkeypatch: Any, capsys: Any) -> None:
    from lg_husky_sim import extras
    monkeypatch.setattr(extras, 'find_spec', lambda name: None if name == module else object())
    assert run(['diagnose', str(folder.parent / HOSTILE), '--out', str(tmp_path / 'out')]) == 1
    assert f'{module} is needed to' in capsys.readouterr().err
    assert not (tmp_path / 'out').exists()


def test_files_without_a_report(diagnosed: Callable[[str], Case], tmp_path: Path) -> None:
    write_files(tmp_path, diagnosed('nothing'), with_report=False)
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        'diagnosis.json', 'diagnosis.txt', 'model.yaml', 'plain.yaml']
