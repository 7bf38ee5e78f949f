# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The live twin in simulated time."""

from __future__ import annotations

import time

from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.ros import api
from lg_husky_sim.ros.settings import make_settings
from lg_husky_sim.ros.tool import Elapsed, joined, Tool
from lg_husky_sim.ros.twin import SILENCE, Twin
from lg_husky_sim.testing.live import isolated_domain
import pytest


def test_simulated_time_ends_a_twin_and_spaces_its_lines() -> None:
    """Its times were those of the system's clock whatever `use_sim_time` said."""
    with isolated_domain(), joined(('-p', 'use_sim_time:=true')) as orderly:
        tool = Tool('lg_husky_twin', orderly)
        clock = api.message_type('rosgraph_msgs/msg/Clock')
        ticking, ticks = tool.node.create_publisher(clock, '/clock', 10), 0

        def tick() -> None:
            nonlocal ticks
            ticks += 1
            message = clock()
            # Twenty times as fast as the system's, from 1000 s on; then it stands.
            message.clock.sec, part = divmod(5000 + min(ticks, 200), 5)
            message.clock.nanosec = part * 2 * 10**8
            ticking.publish(message)
        api.steady_timer(tool.node, 0.01, tick)
        plant = compile_model(Structure()).at(load_model().parameters)
        twin = Twin(tool, {'plain': plant}, make_settings(), lambda names, rates: (0.0, 0.0))
        lines: list[tuple[float, bool]] = []
        try:
            tool.wait_for_time(10.0)
            before, begun = tool.now(), time.monotonic()
            twin.run(20.0, 5.0, lambda *one: lines.append(one))
            assert tool.now() - before == pytest.approx(20.0, abs=3.0)
            assert time.monotonic() - begun < 15.0
            # A robot that was killed may have been the one whose clock it is.
            while tool.now() < 1040.0:
                tool.serve()
            begun = time.monotonic()
            twin.spin(0.5)
            assert SILENCE < time.monotonic() - begun < 10.0 * SILENCE
        finally:
            tool.close()
    assert [round(passed / 5.0) for passed, _ in lines] == [1, 2, 3, 4]


def test_a_clock_that_is_set_back_ends_nothing_later() -> None:
    clock = [100.0]
    passed = Elapsed(lambda: clock[0])
    for moment, expected in ((103.0, 3.0), (0.0, 3.0), (0.5, 3.5), (0.5, 3.5)):
        clock[0] = moment
        assert passed() == pytest.approx(expected)
