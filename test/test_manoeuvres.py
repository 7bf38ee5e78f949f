# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Command scripts drive what they say, and say in one line what is wrong with them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from lg_husky_sim.errors import CommandError
from lg_husky_sim.manoeuvres import (
    builtin_manoeuvres,
    find_manoeuvre,
    load_manoeuvre,
    Manoeuvre,
    Step,
)
import numpy as np
import pytest
from scipy.integrate import trapezoid

HEAD = 'schema: lg_husky_sim/commands/1\n'


def test_steps_ramps_and_the_last_command() -> None:
    script = Manoeuvre('m', (Step(1.0, 0.4, 0.0), Step(1.0, 0.8, -0.5, ramp=0.5)), rate=10.0)
    commands = script.commands()
    assert commands.names == ('forward', 'yaw')
    np.testing.assert_allclose(commands.times, np.arange(21) / 10)
    np.testing.assert_allclose(commands.column('forward')[:11], 0.4)  # a jump, then it holds
    np.testing.assert_allclose(commands.column('forward')[11:16], (0.48, 0.56, 0.64, 0.72, 0.8))
    np.testing.assert_allclose(commands.column('yaw')[13], -0.3)
    np.testing.assert_allclose(commands.values[16:], [(0.8, -0.5)] * 5)


def test_a_script_whose_end_is_between_two_commands() -> None:
    commands = Manoeuvre('m', (Step(0.25, 1.0, 0.0),), rate=10.0).commands()
    np.testing.assert_allclose(commands.times, (0.0, 0.1, 0.2, 0.25))


def test_the_papers_manoeuvres() -> None:
    """The circle is one full turn; the two others come back to their course."""
    assert list(builtin_manoeuvres())[:3] == ['circle', 's_bend', 'obstacle']
    turned = {}
    for name, script in builtin_manoeuvres().items():
        commands = script.commands()
        assert np.max(np.abs(commands.column('forward'))) <= 1.0
        assert np.max(np.abs(commands.column('yaw'))) <= 1.0
        np.testing.assert_array_equal(commands.values[[0, -1]], 0.0)
        turned[name] = trapezoid(commands.column('yaw'), commands.times)
        assert script.about
    assert turned['circle'] == pytest.approx(2.0 * math.pi, abs=0.05)
    assert turned['s_bend'] == pytest.approx(0.0, abs=0.01)
    assert turned['obstacle'] == pytest.approx(0.0, abs=0.01)


def test_a_script_is_read(tmp_path: Path) -> None:
    path = tmp_path / 'turn.yaml'
    path.write_text(HEAD + 'about: a turn\nrate: 5\nsteps:\n- {duration: 1, yaw: 0.5}\n')
    script = load_manoeuvre(path)
    assert (script.name, script.about, script.rate) == ('turn', 'a turn', 5.0)
    assert script.steps == (Step(1.0, 0.0, 0.5),)


@pytest.mark.parametrize(('text', 'message'), [
    ('steps: []', 'schema is missing, expected the line schema: lg_husky_sim/commands/1'),
    (HEAD, 'steps is not a list'),
    (HEAD + 'steps: []', 'steps is empty'),
    (HEAD + 'steps: [1]', 'step 1: the step is not a mapping'),
    (HEAD + 'steps: [{forward: 1}]', 'step 1: duration is missing'),
    (HEAD + 'steps: [{duration: 1}, {duration: -1}]', 'step 2: duration = -1 s must be positive'),
    (HEAD + 'steps: [{duration: 1, ramp: 2}]', r'ramp = 2 s must lie between 0 and the duration'),
    (HEAD + 'steps: [{duration: 1, speed: 2}]', "unknown key 'speed' .allowed: duration, for"),
    (HEAD + 'steps: [{duration: x}]', "duration = 'x' is not a number"),
    (HEAD + 'steps: [{duration: true}]', 'duration = True is not a number'),
    (HEAD + 'steps: [{duration: 1, forward: .nan}]', 'forward = nan is not finite'),
    (HEAD + 'steps: [{duration: 1, yaw: 900}]', r'yaw = 900 rad/s is beyond ±100 rad/s'),
    (HEAD + 'rate: 0\nsteps: [{duration: 1}]', 'rate = 0 Hz must be positive'),
    (HEAD + 'rate: 1000\nsteps: [{duration: 90000}]', 'is too long'),
    (HEAD + 'steps: [{duration: 1', 'not YAML'),
])
def test_what_is_wrong_with_a_script(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / 'script.yaml'
    path.write_text(text)
    with pytest.raises(CommandError, match=message) as raised:
        load_manoeuvre(path)
    assert str(raised.value).startswith(str(path))
    assert '\n' not in str(raised.value)


def test_an_unknown_name_lists_those_there_are() -> None:
    with pytest.raises(CommandError, match=r"no manoeuvre 's_band'; did you mean s_bend\? "
                                           r'\(there are circle, s_bend, obstacle'):
        find_manoeuvre('s_band')


@pytest.mark.parametrize('value', [math.inf, math.nan])
def test_numbers_are_finite(value: Any) -> None:
    with pytest.raises(CommandError, match='is not finite'):
        Step(value, 0.0, 0.0)
