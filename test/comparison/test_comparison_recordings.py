# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The paper's parameters on real Huskys.

The expected numbers were measured by a script of other authorship, as orders of magnitude: a
large departure would be an error of unit or sign on one side.
"""

from __future__ import annotations

from pathlib import Path

from lg_husky_sim.comparison.models import NamedPlant
from lg_husky_sim.comparison.outcome import compare_recording
from lg_husky_sim.recording import read_recording, segments
import numpy as np
import pytest


@pytest.mark.parametrize(('name', 'wheel_speed', 'yaw_rate'), [
    ('husky_wet_grass', 2.4, 0.69),
    ('husky_deflated_tile', 1.5, 0.40),
])
def test_the_size_of_the_mismatch(
    name: str, wheel_speed: float, yaw_rate: float, recordings: Path, paper: NamedPlant,
) -> None:
    outcome = compare_recording(read_recording(recordings / name), [paper])
    errors = outcome.errors('paper')
    assert errors['wheel_speed'].rmse == pytest.approx(wheel_speed, rel=0.1)
    assert errors['yaw_rate'].rmse == pytest.approx(yaw_rate, rel=0.1)


@pytest.mark.parametrize(('name', 'count', 'seconds', 'streams'), [
    ('husky_wet_grass', 6, 251.2, 'command wheels pose currents voltage'),
    ('husky_wheels_up_a', 1, 120.9, 'command wheels pose currents voltage'),
    ('husky_wheels_up_b', 2, 244.2, 'command wheels pose currents voltage'),
    ('husky_deflated_tile', 1, 618.25, 'command wheels imu pose'),
    ('warthog_asphalt', 1, 599.9, 'command wheels imu pose'),
])
def test_all_recordings_are_read(
    name: str, count: int, seconds: float, streams: str, recordings: Path,
) -> None:
    recording = read_recording(recordings / name)
    assert set(recording.streams) == set(streams.split())
    parts = segments(recording)
    assert len(parts) == count
    assert sum(part.duration for part in parts) == pytest.approx(seconds, abs=0.2)


def test_signs_agree_with_rep_103(recordings: Path) -> None:
    """A positive yaw command turns left: the right wheels lead, gyro and heading grow."""
    streams = read_recording(recordings / 'husky_deflated_tile').streams
    times = streams['wheels'].times
    command = np.interp(times, streams['command'].times, streams['command'].column('yaw'))
    turning = streams['wheels'].column('right') - streams['wheels'].column('left')
    gyro = np.interp(times, streams['imu'].times, streams['imu'].column('yaw_rate'))
    heading = np.interp(times, streams['pose'].times, streams['pose'].column('heading'))
    slope = np.gradient(heading, times)
    for other in (turning, gyro, slope):
        assert np.corrcoef(command, other)[0, 1] > 0.8
