# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A recorder in simulated time: it joins by itself, so no probe of a module may be there."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from lg_husky_sim.errors import CommandError
from lg_husky_sim.ros import api
from lg_husky_sim.ros.recorder import NAME, record
from lg_husky_sim.ros.settings import make_settings
from lg_husky_sim.ros.tool import joined, Tool
from lg_husky_sim.testing.live import isolated_domain
import pytest
import yaml

TIMED = ('-p', 'use_sim_time:=true')
pytestmark = pytest.mark.skipif(not any(map(find_spec, ('rosbags', 'rosbag2_py'))),
                                reason='nothing is installed that writes bags')


def test_simulated_time_stamps_a_bag_and_ends_it(tmp_path: Path) -> None:
    """As `ros2 bag record --use-sim-time`; the parameter was taken and had no effect."""
    with isolated_domain(), joined(TIMED) as orderly:
        tool = Tool(NAME, orderly)
        odometry = api.message_type('nav_msgs/msg/Odometry')
        clock = api.message_type('rosgraph_msgs/msg/Clock')
        mouth = tool.node.create_publisher(odometry, 'ground_truth', 10)
        ticking = tool.node.create_publisher(clock, '/clock', 10)
        ticks = 0

        def tick() -> None:
            nonlocal ticks
            ticks += 1
            message = clock()
            # Ten times as fast as the system's, from 1000 s on.
            message.clock.sec, part = divmod(10_000 + ticks, 10)
            message.clock.nanosec = part * 10**8
            ticking.publish(message)
            mouth.publish(odometry())
        api.steady_timer(tool.node, 0.01, tick)
        try:
            said: list[str] = []
            record(tool, tmp_path / 'bag', make_settings(), seconds=20.0, say=said.append)
        finally:
            tool.close()
    assert said[0] == 'waiting for /clock'
    told = yaml.safe_load((tmp_path / 'bag' / 'metadata.yaml').read_text())[
        'rosbag2_bagfile_information']
    assert told['duration']['nanoseconds'] == pytest.approx(20e9, abs=4e9)
    began = told['starting_time']['nanoseconds_since_epoch']
    assert 1000e9 <= began <= (10_000 + ticks) * 1e8


def test_a_clock_that_does_not_come_is_an_error(tmp_path: Path) -> None:
    with isolated_domain(), joined(TIMED) as orderly:
        tool = Tool(NAME, orderly)
        try:
            with pytest.raises(CommandError, match=r'received on /clock for 0\.2 s'):
                record(tool, tmp_path / 'bag', make_settings(), wait=0.2)
        finally:
            tool.close()
    assert list(tmp_path.iterdir()) == []
