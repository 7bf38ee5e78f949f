# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Poses without frames of the robot, and what is said of samples of no use."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from lg_husky_sim.recording import read_recording
import numpy as np
import pytest

PLAIN, CERTAIN = 'geometry_msgs/msg/PoseStamped', 'geometry_msgs/msg/PoseWithCovarianceStamped'
NAN = math.nan


def posed(writer: Any, time: float, x: float, *, kind: str = PLAIN, topic: str = '/localisation',
          turn: tuple[float, float] = (0.0, 1.0)) -> None:
    """Add a pose at x with z and w of its quaternion."""
    pose = writer.new('geometry_msgs/msg/Pose',
                      writer.new('geometry_msgs/msg/Point', x, 0.0, 0.0),
                      writer.new('geometry_msgs/msg/Quaternion', 0.0, 0.0, *turn))
    if kind == CERTAIN:
        pose = writer.new('geometry_msgs/msg/PoseWithCovariance', pose, np.zeros(36))
    header = writer.header(1_700_000_000 * 10**9 + round(time * 1e9), 'map')
    writer.add(topic, kind, time, writer.new(kind, header, pose))


def moved(writer: Any, kind: str = PLAIN, **more: Any) -> None:
    for k in range(10):
        writer.twist(0.1 * (k + 1), 0.5, 0.0)
        posed(writer, 0.1 * (k + 1), 0.05 * k, kind=kind, **more)


@pytest.mark.parametrize('kind', [PLAIN, CERTAIN])
def test_a_pose_without_a_frame_of_the_robot_is_that_of_its_base(
        bag: Any, tmp_path: Path, kind: str) -> None:
    moved(bag, kind, turn=(math.sin(0.2), math.cos(0.2)))
    recording = read_recording(bag.write(tmp_path / 'bag'))
    np.testing.assert_allclose(recording.stream('pose').values[:, 0], 0.05 * np.arange(10))
    np.testing.assert_allclose(recording.stream('pose').values[:, 2], 0.4)
    assert recording.topics['pose'] == '/localisation'
    assert any('taken for that of its base' in note for note in recording.notes)


def test_odometry_goes_before_and_a_goal_is_no_pose(bag: Any, tmp_path: Path) -> None:
    moved(bag, topic='/goal_pose')
    path = bag.write(tmp_path / 'goal')
    assert 'pose' not in read_recording(path).streams
    moved(bag)
    bag.odometry(0.5, 1.0, 0.0, 0.0, topic='/somewhere/wheels')
    bag.odometry(0.6, 1.1, 0.0, 0.0, topic='/somewhere/wheels')
    assert read_recording(bag.write(tmp_path / 'both')).topics['pose'] == '/somewhere/wheels'


def test_poses_without_a_heading_are_called_so(bag: Any, tmp_path: Path) -> None:
    moved(bag, turn=(0.0, 0.0))
    notes = read_recording(bag.write(tmp_path / 'bag')).notes
    assert ('map>base_link: 10 of 10 samples were dropped: 10 without a heading (a quaternion of '
            'zeros or no numbers)') in notes


def test_what_is_wrong_with_samples_is_counted(bag: Any, tmp_path: Path) -> None:
    for k, speed in enumerate((0.1, NAN, 0.2, 1e9, math.inf)):
        bag.twist(0.1 * (k + 1), speed, 0.0)
        bag.joints(0.1 * (k + 1), ('left_wheel', 'right_wheel'), (NAN, NAN))
        bag.imu(0.1 * (k + 1), 0.1)
    notes = read_recording(bag.write(tmp_path / 'bag')).notes
    assert 'command: 3 of 5 samples were dropped: 1 not a number, 2 beyond 1e+08' in notes
    assert 'wheels: 5 of 5 samples were dropped: 5 not a number' in notes
