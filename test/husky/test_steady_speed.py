# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Speeds at which a robot settles: the formulas, the page's examples and what simulate says."""

from __future__ import annotations

from pathlib import Path
import re
from typing import Any

import lg_husky_sim as lg
from lg_husky_sim.cli.main import run
from lg_husky_sim.husky.steady_speed import steady_shares
import numpy as np
import pytest

PAGE = Path(__file__).resolve().parents[2] / 'docs' / 'other_robots.md'
ROBOTS: dict[str, dict[str, float]] = {
    'Husky': {}, 'half the supply': {'supply_voltage': 12.0},
    'little slip': {'wheel_damping': 20.0},
    'another size': {
        'mass': 17.0, 'yaw_inertia': 0.43, 'wheel_radius': 0.098, 'track': 0.376,
        'wheel_inertia': 0.01, 'torque_constant': 0.013, 'motor_resistance': 2.45,
        'command_gain': 0.5, 'turn_ratio': 0.376, 'wheel_damping': 0.2, 'yaw_damping': 2.0}}


def reached(robot: lg.Husky) -> tuple[float, float]:
    """Return the shares of a small speed and yaw rate that a simulation settles at."""
    times = np.arange(0.0, 20.0, 0.02)
    still, level = np.zeros(times.size), np.full(times.size, 0.2)
    path = robot.simulate((times, level, still)).pose
    turn = robot.simulate((times, still, level)).pose
    seconds = float(path.times[-1] - path.times[-51])
    return (float(path.values[-1, 0] - path.values[-51, 0]) / seconds / 0.2,
            float(turn.values[-1, 2] - turn.values[-51, 2]) / seconds / 0.2)


@pytest.mark.parametrize('name', ROBOTS)
def test_a_simulation_settles_where_the_formulas_say(name: str) -> None:
    robot = lg.Husky(None, **ROBOTS[name])
    assert reached(robot) == pytest.approx(steady_shares(robot.parameters), rel=1e-6)


def test_the_robots_of_the_page_drive_as_commanded(tmp_path: Path) -> None:
    text = PAGE.read_text(encoding='utf-8')
    names: dict[str, Any] = {}
    exec(re.findall(r'```python\n(.*?)```', text, re.DOTALL)[0].replace(
        "'jackal.yaml'", repr(str(tmp_path / 'jackal.yaml'))), names)
    (tmp_path / 'rover.yaml').write_text(
        re.findall(r'```yaml\n(.*?)```', text, re.DOTALL)[0], encoding='utf-8')
    for robot in (names['jackal'], lg.Husky(tmp_path / 'rover.yaml')):
        assert reached(robot) == pytest.approx((1.0, 1.0), abs=0.005)
        assert f'{robot.parameters["yaw_damping"]:g} for the' in text
    assert '{:.3f} times the commanded speed and turns at {:.3f} times'.format(
        *steady_shares(lg.Husky().parameters)) in text.replace('\n', ' ')


@pytest.mark.parametrize(('given', 'commands', 'said'), [
    ([], 's_bend', []),
    (['--set', 'supply_voltage=12'], 'straight', [
        'the model drives straight at 0.51 times the commanded speed; command_gain = '
        'torque_constant gear_ratio / (supply_voltage wheel_radius) = 1.767 s/m would']),
    (['--set', 'yaw_damping=2'], 'straight', []),
    (['--set', 'yaw_damping=2'], 'spin', [
        'the model turns at 1.68 times the commanded yaw rate; with yaw_damping = 2 N·m·s/rad, '
        'turn_ratio = 0.3257 m fits'])])
def test_simulate_says_what_a_model_misses(
        given: list[str], commands: str, said: list[str], tmp_path: Path,
        capsys: pytest.CaptureFixture[str]) -> None:
    assert run(['simulate', *given, '--commands', commands, '--out', str(tmp_path / 'bag')]) == 0
    shown = [line for line in capsys.readouterr().out.splitlines() if 'by its parameters' in line]
    assert len(shown) == len(said)
    for line, words in zip(shown, said, strict=True):
        assert words in line
