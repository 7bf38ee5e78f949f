# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky evaluate` without options, as a fresh install runs it: without MuJoCo."""

from __future__ import annotations

import json
from pathlib import Path
import sys

from lg_husky_sim.api.robots import Husky
from lg_husky_sim.cli.main import run
from lg_husky_sim.evaluation import session
from lg_husky_sim.evaluation.cases import MANOEUVRES, synthetic_case
import pytest

for needed in ('jinja2', 'matplotlib'):
    pytest.importorskip(needed)


@pytest.mark.parametrize('installed', [False, True])
def test_without_mujoco_the_engine_is_left_out_and_said(
        installed: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str]) -> None:
    if installed:
        pytest.importorskip('mujoco')
    else:
        monkeypatch.setitem(sys.modules, 'mujoco', None)
    asked: list[tuple[str, ...]] = []

    def evaluated(request: session.Request, *_: object) -> session.Evaluation:
        asked.append(tuple(request.cases))
        return session.Evaluation('six numbers', {'cases': []})
    monkeypatch.setattr(session, 'run_evaluation', evaluated)
    assert run(['evaluate', '--out', str(tmp_path / 'out')]) == 0
    assert asked == [('synthetic', 'engine') if installed else ('synthetic',)]
    said = capsys.readouterr()
    assert ('it needs MuJoCo' in said.out + said.err) is not installed


def test_the_result_is_printed_as_json(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                       capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(session, 'run_evaluation', lambda *_: session.Evaluation(
        'six numbers', {'cases': [{'what_to_change': {'differences': []}}]}))
    assert run(['evaluate', '--out', str(tmp_path / 'out'), '--case', 'synthetic', '--json']) == 0
    said = capsys.readouterr()
    assert json.loads(said.out)['cases'] == [{'what_to_change': {'differences': []}}]
    assert str(tmp_path / 'out' / 'index.html') in said.err


def test_the_synthetic_case_needs_no_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, 'mujoco', None)
    case = synthetic_case(0)
    assert list(case.recordings) == list(MANOEUVRES)
    assert case.rivals == {}


@pytest.fixture(scope='module')
def rover(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a robot of 6 kg: its model, and two recordings of it."""
    folder = tmp_path_factory.mktemp('rover')
    robot = Husky(about='our rover', mass=6.0, yaw_inertia=0.08, wheel_radius=0.05, track=0.24,
                  wheelbase=0.18, wheel_inertia=8e-4, motor_resistance=1.8, torque_constant=0.02,
                  gear_ratio=30.0, supply_voltage=12.0, wheel_damping=0.02, yaw_damping=0.15,
                  turn_ratio=0.22)
    robot.save(folder / 'rover.yaml')
    real = robot.replacing(wheel_damping=0.05, yaw_damping=0.4)
    for name in ('circle', 'spin'):
        real.simulate(name).save(folder / name)
    return folder


@pytest.mark.parametrize('cases', [(), ('--case', 'synthetic')])
def test_the_built_in_cases_are_no_other_robot(
        rover: Path, cases: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(['evaluate', '--robot', str(rover / 'rover.yaml'), '--out', str(rover / 'none'),
                *cases]) == 1
    said = capsys.readouterr().err
    assert 'built-in cases are a Husky, and the model is none (wheel radius 0.05 m' in said
    assert '--calibrate REC' in said
    assert not (rover / 'none').exists()


def test_another_robot_is_not_compared_with_the_papers_numbers(rover: Path) -> None:
    out = rover / 'out'
    assert run(['evaluate', '--robot', str(rover / 'rover.yaml'), '--out', str(out),
                '--calibrate', str(rover / 'circle'), '--held-out', str(rover / 'spin'),
                '--starts', '1']) == 0
    text = (out / 'evaluation.txt').read_text(encoding='utf-8')
    assert 'LG, given numbers' in text
    assert "paper's numbers" not in text
    (row,) = [line.split() for line in text.splitlines() if line.startswith('wheel_damping [')]
    assert row[-1] == '–'
