# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The paper's evaluation on a synthetic robot, on an engine's, and as a command."""

from __future__ import annotations

from collections.abc import Callable
import json
from pathlib import Path
from typing import Any

from lg_husky_sim.cli.main import run
from lg_husky_sim.errors import CommandError, SettingsError
from lg_husky_sim.evaluation import engine, session
from lg_husky_sim.evaluation.cases import MANOEUVRES, recorded_case
from lg_husky_sim.evaluation.engine import drive, engine_config, engine_robot
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.manoeuvres import find_manoeuvre
import numpy as np
import pytest

pytest.importorskip('mujoco')
pytest.importorskip('jinja2')
pytest.importorskip('matplotlib')


@pytest.fixture(scope='module')
def evaluated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp('evaluation') / 'out'
    assert run(['evaluate', '--out', str(out), '--case', 'synthetic', '--starts', '2']) == 0
    return out


def test_the_command_writes_tables_figures_and_models(evaluated: Path) -> None:
    names = {path.name for path in evaluated.iterdir()}
    assert {'index.html', 'evaluation.json', 'evaluation.txt'} < names
    assert {f'synthetic_fig{k}.png' for k in range(12, 17)} < names
    for kind in ('ga', 'least_squares', 'base'):
        assert load_model(evaluated / f'synthetic_{kind}.yaml').parameters['wheel_damping'] > 0.0


def test_the_six_numbers_stand_beside_the_papers(evaluated: Path) -> None:
    (case,) = json.loads((evaluated / 'evaluation.json').read_text())['cases']
    rows = case['tracking_error']
    assert [row['manoeuvre'] for row in rows] == list(MANOEUVRES)
    assert [row['held_out'] for row in rows] == [False, True, True]
    assert rows[1]['paper'] == [0.0352, 0.1027]
    text = (evaluated / 'evaluation.txt').read_text()
    for row in rows:
        for value in row['bounds']['LG, least squares']:
            assert f'{value:.4f}' in text


def test_what_to_change_is_said_of_the_closest_calibrated_model(evaluated: Path) -> None:
    (case,) = json.loads((evaluated / 'evaluation.json').read_text())['cases']
    said = case['what_to_change']
    worst = {label: max(max(row['bounds'][label]) for row in case['tracking_error']
                        if row['held_out']) for label in case['fits']}
    assert said['model'] == min(worst, key=lambda label: worst[label])
    # Least squares on this very graph leaves no gain and no delay.
    assert said['compared']
    assert said['differences'] == []
    assert 'Gains and delays agree' in (evaluated / 'index.html').read_text()


def test_held_out_errors_are_of_the_papers_size_or_better(evaluated: Path) -> None:
    (case,) = json.loads((evaluated / 'evaluation.json').read_text())['cases']
    for row in case['tracking_error'][1:]:
        assert max(row['bounds']['LG, least squares']) < 0.1
        assert max(row['bounds']["LG, paper's numbers"]) > max(row['bounds']['LG, least squares'])
        assert max(row['bounds']['engine, nominal']) > 0.3
    truth = engine_config()['truth']
    values = {p['name']: p for p in case['fits']['LG, least squares']['parameters']}
    # Mass and inertia of the truth are others too, and stay nominal in the fit.
    ratio = values['yaw_damping']['value'] / values['wheel_damping']['value']
    assert ratio == pytest.approx(truth['yaw_damping'] / truth['wheel_damping'], rel=0.02)
    assert values['command_gain']['value'] == pytest.approx(truth['command_gain'], rel=0.005)


def test_the_page_works_in_a_browser(visited: Callable[..., dict[str, Any]], evaluated: Path
                                     ) -> None:
    seen = visited(evaluated / 'index.html')
    (case,) = json.loads((evaluated / 'evaluation.json').read_text())['cases']
    assert seen['alive']
    assert [name.split(': ')[-1] for name in seen['recordings']] == list(MANOEUVRES)
    assert min(seen['drawn'][1:]) > len(case['fits'])
    assert seen['values'] != seen['errors']
    low, high = seen['range']
    assert seen['in'] == pytest.approx([low + (high - low) / 4, high - (high - low) / 4])
    assert seen['clicked'] == pytest.approx([1.0, 11.0])
    assert len(set(seen['coloured'])) == len(seen['coloured']) > len(case['fits'])


def test_recordings_are_evaluated_with_a_rival(tmp_path: Path, evaluated: Path,
                                               capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip('rosbags')
    for name in ('circle', 's_bend'):
        assert run(['simulate', '--commands', name, '--out', str(tmp_path / name),
                    '--set', 'yaw_damping=20']) == 0
        assert run(['simulate', '--commands', name, '--out', str(tmp_path / f'{name}_rival'),
                    '--set', 'yaw_damping=25']) == 0
    out = tmp_path / 'out'
    assert run(['evaluate', '--out', str(out), '--calibrate', str(tmp_path / 'circle'),
                '--held-out', str(tmp_path / 's_bend'), '--rival', str(tmp_path / 'circle_rival'),
                '--rival', str(tmp_path / 's_bend_rival'), '--starts', '1']) == 0
    (case,) = json.loads((out / 'evaluation.json').read_text())['cases']
    held = case['tracking_error'][1]
    assert held['manoeuvre'] == 's_bend'
    assert max(held['bounds']['LG, least squares']) < 0.01
    assert max(held['bounds']['rival']) > 0.1
    assert f'Largest held-out error, {case["case"]}: ' in capsys.readouterr().out


def test_the_engine_turns_less_on_grippy_ground_and_weighs_what_it_should() -> None:
    import mujoco
    nominal, robot = engine_robot('nominal'), engine_robot('robot')
    model = mujoco.MjModel.from_xml_string(nominal.mjcf())
    assert float(np.sum(model.body_mass)) == pytest.approx(56.58, abs=0.01)
    commands = find_manoeuvre('circle').commands()
    stiff, sliding = drive(nominal, commands), drive(robot, commands)
    assert 1.0 < stiff.column('heading')[-1] < sliding.column('heading')[-1]
    # Clearpath's multiplier of 1.875 is made for sliding: one full turn was commanded.
    assert sliding.column('heading')[-1] == pytest.approx(2.0 * np.pi, rel=0.1)
    straight = stiff.times < 4.5
    assert np.max(np.abs(stiff.column('y')[straight])) < 0.01
    assert stiff.column('forward')[200] == pytest.approx(0.5, rel=0.02)
    again = drive(nominal, commands)
    np.testing.assert_array_equal(again.values, stiff.values)


def test_bad_requests_are_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str],
                                   monkeypatch: pytest.MonkeyPatch) -> None:
    assert run(['evaluate', '--out', str(tmp_path / 'x'), '--held-out', 'a']) == 2
    assert '--held-out and --rival need --calibrate' in capsys.readouterr().err
    with pytest.raises(CommandError, match='give exactly one'):
        recorded_case(['a', 'b'], [], [])
    with pytest.raises(CommandError, match='1 rivals for 2 recordings'):
        recorded_case(['a'], ['b'], ['c'])
    with pytest.raises(SettingsError, match='no engine robot'):
        engine_robot('tank')
    monkeypatch.setattr(engine, 'engine_config', lambda: {
        'nominal': {'mass': 1.0}, 'robot': {}})
    with pytest.raises(SettingsError, match='unknown or missing'):
        engine.engine_robot('nominal')
    monkeypatch.setattr(session, 'evaluate_case', None)   # what cannot be read is said before
    assert run(['evaluate', '--case', 'synthetic', '--steps', str(tmp_path / 'none'), '--out',
                str(tmp_path / 'x')]) == 1
    assert str(tmp_path / 'none') in capsys.readouterr().err
    occupied = tmp_path / 'full'
    occupied.mkdir()
    (occupied / 'thesis.txt').write_text('mine')
    assert run(['evaluate', '--out', str(occupied)]) == 1
    assert (occupied / 'thesis.txt').read_text() == 'mine'
