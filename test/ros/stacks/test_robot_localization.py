# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""robot_localization's EKF, unmodified, on the node's odometry and IMU, against its truth."""

from __future__ import annotations

from collections.abc import Callable
import math
from pathlib import Path
import sys
from typing import Any

from lg_husky_sim.ros import api
from lg_husky_sim.testing.live import LiveHusky, Probe
import pytest

#: Largest distance between the filter and the truth, as a share of the way driven. The wheels'
#: speed along the true heading comes to 1.0, 1.2 and 1.8 %, so nothing is left for the filter to
#: add; with the wheels' yaw rate instead of the IMU it is 3.5, 2.2 and 3.1 %.
BOUND = 0.02
#: Simulated seconds per second.
SPEED = 1.0
CONFIG = """\
/**:
  ros__parameters:
    use_sim_time: true
    frequency: 50.0
    two_d_mode: true
    publish_tf: true
    odom_frame: odom
    base_link_frame: base_link
    world_frame: odom
    odom0: husky_velocity_controller/odom
    odom0_config: [false, false, false, false, false, false, true, true, false,
                   false, false, false, false, false, false]
    imu0: imu/data
    imu0_config: [false, false, false, false, false, true, false, false, false,
                  false, false, true, false, false, false]
"""


def place(message: Any) -> tuple[int, float, float]:
    """Return stamp [ns] and position of an Odometry."""
    stamp = int(message.header.stamp.sec) * 10**9 + int(message.header.stamp.nanosec)
    position = message.pose.pose.position
    return stamp, float(position.x), float(position.y)


@pytest.mark.realtime
@pytest.mark.parametrize('manoeuvre', ['circle', 's_bend', 'obstacle'])
def test_the_filter_agrees_with_the_truth(
        probe: Probe, start: Callable[..., LiveHusky], run: Callable[..., Any],
        program: Callable[[str, str], Path], tmp_path: Path, manoeuvre: str) -> None:
    """Vx of the wheels with heading and yaw rate of the IMU: within 2 % of the way, all along."""
    ekf_node = program('robot_localization', 'ekf_node')
    (tmp_path / 'ekf.yaml').write_text(CONFIG, encoding='utf-8')
    truth = probe.listen('nav_msgs/msg/Odometry', '/ground_truth', 200)
    filtered = probe.listen('nav_msgs/msg/Odometry', '/odometry/filtered', 200)
    truth.clear()
    filtered.clear()
    # What robot_state_publisher says of the packaged URDF.
    static, transforms = probe.talk('tf2_msgs/msg/TFMessage', '/tf_static', api.QoSProfile(
        depth=1, durability=api.DurabilityPolicy.TRANSIENT_LOCAL))
    mounted = api.message_type('geometry_msgs/msg/TransformStamped')()
    mounted.header.frame_id, mounted.child_frame_id = 'base_link', 'imu_link'
    static.publish(transforms(transforms=[mounted]))
    husky = start(preset='husky_ros1', publish_clock=True, speed=SPEED)
    husky.ready(truth)
    run(ekf_node, '--ros-args', '--params-file', tmp_path / 'ekf.yaml')
    assert probe.until(lambda: len(filtered) > 20, 30.0)
    drive = run(Path(sys.executable), '-m', 'lg_husky_sim.cli.main', 'drive', manoeuvre,
                '--preset', 'husky_ros1', '--namespace', '/', '--ros-args', '-p',
                'use_sim_time:=true')
    assert probe.until(lambda: drive.poll() is not None, 240.0)
    assert drive.returncode == 0
    probe.spin(1.0)
    true = {stamp: (x, y) for stamp, x, y in map(place, truth)}
    way = sum(math.dist(a, b) for a, b in zip(
        list(true.values())[:-1], list(true.values())[1:], strict=True))
    pairs = [((x, y), true[stamp]) for stamp, x, y in map(place, filtered) if stamp in true]
    worst = max(math.dist(*pair) for pair in pairs)
    print(f'figure: {manoeuvre}: {way:.1f} m, filter within {worst:.3f} m ({worst / way:.1%})')
    assert way > 3.0
    assert len(pairs) > 100
    assert worst < BOUND * way
