# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Streams of a few readings: they tell nothing, and do not end a diagnosis."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.diagnosis.evidence.drives import drive_of
from lg_husky_sim.diagnosis.evidence.observation import observe, simulate
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.recording import Recording, Segment
from lg_husky_sim.signals import TimeSeries
import numpy as np
import pytest


@pytest.mark.parametrize('count', [1, 2, 3, 4])
@pytest.mark.parametrize('name', ['wheels', 'imu', 'pose'])
def test_a_stream_of_a_few_readings_is_left_out(
        drive: Callable[..., Recording], robot: Callable[..., Plant], name: str, count: int
        ) -> None:
    recording = drive('short', 'nothing', 1, share=0.5)
    few = recording.streams[name]
    streams = {**recording.streams,
               name: TimeSeries(few.times[:count], few.values[:count], few.names)}
    del streams['wheel_angles']
    command = recording.streams['command'].times
    own = drive_of(Segment('short', 0, float(command[0]), float(command[-1]), streams))
    assert own is not None
    times = {'wheels': own.wheel_times, 'imu': own.imu_times, 'pose': own.pose_times}
    assert times.pop(name).size == (count if count > 3 else 0)
    assert min(others.size for others in times.values()) > 100
    seen = observe(simulate(robot(), own, Reading()), own, Reading())
    assert seen.size == own.measured.size
    assert np.all(np.isfinite(seen))
