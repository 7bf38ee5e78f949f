# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A simulated drive as the streams of a recording."""

from __future__ import annotations

from collections.abc import Mapping

from lg_husky_sim.comparison.replay import PERIOD, replay
from lg_husky_sim.errors import CommandError
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.recording import driven_segments, Recording, Segment
from lg_husky_sim.signals import FloatArray, Pose, TimeSeries
from lg_husky_sim.simulation import rollout
import numpy as np

DEFAULT_RATE = 50.0
"""Samples per second [Hz] where a recording does not say otherwise."""

COLUMNS: Mapping[str, tuple[str, ...]] = {
    'wheels': ('wheel_left', 'wheel_right'),
    'wheel_angles': ('angle_left', 'angle_right'),
    'wheel_torques': ('current_left', 'current_right'),
    'imu': ('yaw_rate', 'accel_x', 'accel_y'),
    'pose': ('x', 'y', 'heading'),
}
"""Columns of a simulation that make up each stream."""


def simulate_recording(
    plant: Plant, recording: Recording, torque_per_current: float, rate: float = 0.0,
) -> dict[str, TimeSeries]:
    """
    Drive a plant with a recording's commands, segment by segment.

    Each segment starts in the state that the robot was in, and every command from there on is
    driven, also where the sensors fall silent before their end.

    Parameters
    ----------
    plant : Plant
        Robot to drive, taken as it is in that recording.
    recording : Recording
        With a stream ``command``.
    torque_per_current : float
        Torque on the wheel side per motor current [N·m/A].
    rate : float
        Samples per second [Hz]; 0 for the recording's own stamps, and 50 Hz for what it lacks.

    Returns
    -------
    dict of str to TimeSeries
        Streams of a recording: command (the recorded one), wheels, wheel_angles, wheel_torques,
        imu, pose; times on the recording's clock.

    Raises
    ------
    RecordingError
        If it has no commands.
    CommandError
        If it has no segment to drive.

    """
    recording.stream('command')
    parts, _ = driven_segments(recording)
    if not parts:
        raise CommandError(
            f'recording {recording.name} has no stretch without a gap in which all its streams '
            f'({", ".join(recording.streams)}) overlap')
    period = min(PERIOD, 1.0 / rate) if rate else PERIOD
    here = plant.in_recording(recording.name)
    driven = [_segment_streams(replay(here, part, period), part, torque_per_current, rate)
              for part in parts]
    return {name: _chained([streams[name] for streams in driven]) for name in driven[0]}


def simulate_commands(
    plant: Plant, commands: TimeSeries, torque_per_current: float, rate: float = DEFAULT_RATE,
    pose: Pose | None = None,
) -> dict[str, TimeSeries]:
    """
    Drive a plant from rest with commands.

    Parameters
    ----------
    plant : Plant
        Robot to drive, with its sensors.
    commands : TimeSeries
        Names forward [m/s], yaw [rad/s].
    torque_per_current : float
        Torque on the wheel side per motor current [N·m/A].
    rate : float
        Samples per second [Hz].
    pose : Pose, optional
        Where to start; the origin if not given.

    Returns
    -------
    dict of str to TimeSeries
        As `simulate_recording` returns them.

    """
    start, end = float(commands.times[0]), float(commands.times[-1])
    steps = max(1, int(np.ceil(1.0 / (rate * PERIOD) - 1e-9)))
    period = 1.0 / (rate * steps)  # every sample lies on a step
    seen = plant.observe(rollout(plant, commands, end + period, period, pose=pose))
    times = start + np.arange(int(np.floor((end - start) * rate + 1e-6)) + 1) / rate
    return {'command': commands, **_streams(
        seen, dict.fromkeys(COLUMNS, times), torque_per_current)}


def _segment_streams(
    seen: TimeSeries, segment: Segment, torque_per_current: float, rate: float,
) -> dict[str, TimeSeries]:
    count = int(np.floor((segment.end - segment.start) * (rate or DEFAULT_RATE) + 1e-6)) + 1
    even = segment.start + np.arange(count) / (rate or DEFAULT_RATE)
    stamps: dict[str, FloatArray] = {}
    for name in COLUMNS:
        source = 'wheels' if name.startswith('wheel') else name
        own = segment.streams.get(source) if not rate else None
        # Where a sensor falls silent before the commands end, the drive goes on.
        stamps[name] = even if own is None else np.concatenate(
            [own.times, even[even > own.times[-1]]])
    return {'command': segment.streams['command'],
            **_streams(seen, stamps, torque_per_current)}


def _streams(
    seen: TimeSeries, stamps: Mapping[str, FloatArray], torque_per_current: float,
) -> dict[str, TimeSeries]:
    columns = {name: seen.column(name) for name in seen.names}
    columns['accel_y'] = columns['forward'] * columns['yaw_rate']
    made: dict[str, TimeSeries] = {}
    for name, parts in COLUMNS.items():
        values = np.column_stack(
            [np.interp(stamps[name], seen.times, columns[part]) for part in parts])
        if name == 'wheel_torques':
            values *= 0.5 * torque_per_current  # two wheels share a side's torque
        names = tuple(part.split('_')[-1] for part in parts) if 'wheel' in name else parts
        made[name] = TimeSeries(stamps[name], values, names)
    return made


def _chained(parts: list[TimeSeries]) -> TimeSeries:
    return TimeSeries(np.concatenate([part.times for part in parts]),
                      np.concatenate([part.values for part in parts]), parts[0].names)
