# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A node whose system clock really jumps, below Python, rcl and the middleware (row 52)."""

from __future__ import annotations

from collections.abc import Callable
import itertools
import os
from pathlib import Path
import time
from typing import Any

from lg_husky_sim.testing.live import LiveHusky, Probe
import pytest

#: Debian's libfaketime, which puts itself between a process and the C library's clocks.
LIBRARY = next(iter(sorted(Path('/usr/lib').glob('*/faketime/libfaketime.so.1'))), None)


def stamp(message: Any) -> float:
    """Return the header's stamp [s]."""
    return float(message.header.stamp.sec) + 1e-9 * float(message.header.stamp.nanosec)


@pytest.mark.skipif(LIBRARY is None, reason='libfaketime is not installed (apt install faketime): '
                    'no jump of the system clock is tested')
@pytest.mark.parametrize('jump', [-3600, 3600])
def test_the_robot_goes_on_when_the_system_clock_jumps(
        probe: Probe, start: Callable[..., LiveHusky], tmp_path: Path, jump: int) -> None:
    """It stood for as long as the clock was set back; stamps follow a jump ahead only."""
    offset = tmp_path / 'offset'
    offset.write_text('+0s', encoding='ascii')
    topic = f'/clock_{"ahead" if jump > 0 else "back"}'
    truth = probe.listen('nav_msgs/msg/Odometry', topic, 1000)
    husky = start(ground_truth_topic=topic, rate=10.0, environment={
        'LD_PRELOAD': ' '.join([str(LIBRARY), *os.environ.get('LD_PRELOAD', '').split()]),
        'FAKETIME_TIMESTAMP_FILE': str(offset),
        'FAKETIME_NO_CACHE': '1', 'FAKETIME_DONT_FAKE_MONOTONIC': '1'})
    husky.ready(truth, 60.0)
    # The first one comes before there is a timer.
    assert probe.until(lambda: len(truth) > 5, 60.0)
    truth.clear()
    before = time.time()
    # At once: a process that reads a file without an offset in it has no time.
    other = tmp_path / 'other'
    other.write_text(f'{jump:+d}s', encoding='ascii')
    other.replace(offset)
    assert probe.until(lambda: len(truth) >= 30, 60.0), len(truth)
    stamps = [stamp(message) for message in truth]
    gaps = [b - a for a, b in itertools.pairwise(stamps)]
    assert min(gaps) == pytest.approx(0.1, abs=1e-6)
    assert sorted(gaps)[-2] == pytest.approx(0.1, abs=1e-6)
    # How late a loaded machine is does not matter here.
    assert stamps[-1] - before == pytest.approx(max(jump, 0), abs=100.0)
    assert f'the clock jumped by {jump:+d}' in husky.node.log()
