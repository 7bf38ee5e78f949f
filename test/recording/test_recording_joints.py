# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Joints whose names do not tell the sides, chosen by hand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import lg_husky_sim as lg
from lg_husky_sim.errors import RecordingError
from lg_husky_sim.recording import TopicMap
import numpy as np
import pytest

NAMES = ('motor_1', 'motor_2', 'arm_left_wheel', 'motor_3', 'motor_4')
CHOSEN = {'left_wheels': 'motor_1,motor_3', 'right_wheels': 'motor_2, motor_4'}


@pytest.fixture
def turned(bag: Any, tmp_path: Path) -> Path:
    for k in range(30):
        time = 0.1 * (k + 1)
        bag.twist(time, 0.5, 0.0, stamp=time)
        bag.imu(time, 0.1)
        bag.joints(time, NAMES, (1.0, 10.0, 99.0, 3.0, 30.0))
    path: Path = bag.write(tmp_path / 'bag')
    return path


def test_chosen_joints_are_the_wheels_and_no_others(turned: Path) -> None:
    wheels = lg.read(turned, topics=CHOSEN).stream('wheels')
    np.testing.assert_array_equal(wheels.values, [(2.0, 20.0)] * 30)


def test_a_topic_without_the_chosen_joints_is_passed_over(bag: Any, tmp_path: Path) -> None:
    for k in range(5):
        bag.joints(0.1 * (k + 1), ('left_hand', 'right_hand'), (5.0, 6.0), topic='/joint_states')
        bag.joints(0.1 * (k + 1), NAMES, (1.0, 10.0, 99.0, 3.0, 30.0), topic='/motors/all')
    recording = lg.read(bag.write(tmp_path / 'bag'), topics=CHOSEN)
    assert recording.topics['wheels'] == '/motors/all'


def test_how_to_choose_them_is_said_where_they_are_missing(turned: Path) -> None:
    survey = lg.read(turned).info()
    said = next(one for one in survey.warnings if one.startswith('No wheels'))
    assert '--topic left_wheels=' in said
    assert not any('No wheels' in one for one in lg.read(turned, topics=CHOSEN).info().warnings)


@pytest.mark.parametrize(('chosen', 'message'), [
    ({'left_wheels': 'motor_1'}, 'left_wheels and right_wheels are chosen together'),
    ({'left_wheels': 'motor_1,motor_3', 'right_wheels': 'motor_2,motor_3'},
     'motor_3 is a joint of both sides'),
    ({'left_wheels': 'motor_1', 'right_wheels': 'motor_7'},
     'no joint motor_7 in /joint_states; there are arm_left_wheel, motor_1, motor_2'),
])
def test_a_choice_that_cannot_be_is_refused(turned: Path, chosen: dict[str, str], message: str
                                            ) -> None:
    with pytest.raises(RecordingError, match=message) as caught:
        lg.read(turned, topics=chosen)
    assert '\n' not in str(caught.value)


def test_the_command_line_takes_the_same_words() -> None:
    assert TopicMap.parse(f'{role}={name}' for role, name in CHOSEN.items()).joints() == (
        ('motor_1', 'motor_3'), ('motor_2', 'motor_4'))
    assert TopicMap().joints() is None
