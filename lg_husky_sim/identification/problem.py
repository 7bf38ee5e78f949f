# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Recorded segments as one vector of measurements, and the model's prediction of it.

Simulated pose and wheel angles are set back to the measured ones every few seconds, so that
physics that depends on heading, place or a wheel's angle acts where the robot really was.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeAlias

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.husky.plant import ENCODER_WINDOW, Plant, PlantSet, SensorModel
from lg_husky_sim.identification.fit_segments import (
    Channel,
    CHANNELS,
    correction_name,
    CORRECTIONS,
    FitSegment,
    PERIOD,
    segment_for_fit,
    SETTLE,
    UNITS,
)
from lg_husky_sim.identification.sampling import sample
from lg_husky_sim.identification.segment_simulation import simulate_segment
from lg_husky_sim.recording import Segment
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation.event_kernel import COLUMNS
from lg_husky_sim.simulation.simulator import Simulator
import numpy as np
from numpy.typing import NDArray

__all__ = [
    'CHANNELS',
    'PERIOD',
    'UNITS',
    'Channel',
    'FitSegment',
    'Observations',
    'Slice',
    'late_mask',
    'observations',
    'segment_for_fit',
    'simulate_segment',
]

Simulated: TypeAlias = tuple[FloatArray, tuple[FloatArray, ...]]
_COLUMN = {name: i for i, name in enumerate(COLUMNS)}


@dataclass(frozen=True)
class Slice:
    """Where one channel of one segment lies in the measurement vector."""

    segment: int
    channel: str
    first: int
    last: int


@dataclass(frozen=True, eq=False)
class Observations:
    """
    All segments, and their measurements as one vector.

    Parameters
    ----------
    segments : tuple of FitSegment
    common : numpy.ndarray, shape (n_values, n_common), optional
        Columns of errors that a model may make everywhere alike, each of the size that is
        believed possible; a metric gives them no weight.
    measured : numpy.ndarray, shape (n_values,)
    times : numpy.ndarray, shape (n_values,)
        Stamp of each value on its recording's clock [s].
    slices : tuple of Slice
        In the order of the vector.

    """

    segments: tuple[FitSegment, ...]
    common: FloatArray | None = None
    measured: FloatArray = field(init=False)
    times: FloatArray = field(init=False)
    slices: tuple[Slice, ...] = field(init=False)

    def __post_init__(self) -> None:
        """Stack the measurements."""
        values, times, slices, at = [np.zeros(0)], [np.zeros(0)], [], 0
        for number, segment in enumerate(self.segments):
            for channel in segment.channels:
                values.append(channel.values)
                times.append(channel.times)
                slices.append(Slice(number, channel.name, at, at + channel.values.size))
                at += channel.values.size
        object.__setattr__(self, 'measured', np.concatenate(values))
        object.__setattr__(self, 'times', np.concatenate(times))
        object.__setattr__(self, 'slices', tuple(slices))

    def channel_mask(self, name: str) -> NDArray[np.bool_]:
        """Return which values belong to a channel, shape (n_values,)."""
        mask = np.zeros(self.measured.size, dtype=bool)
        for one in self.slices:
            if one.channel == name:
                mask[one.first:one.last] = True
        return mask

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels that occur, in the order of :data:`CHANNELS`."""
        present = {one.channel for one in self.slices}
        return tuple(name for name in CHANNELS if name in present)

    def predict(self, plant: Plant, extra: Mapping[str, float] | None = None) -> FloatArray:
        """
        Return the model's prediction of the measurement vector.

        Parameters
        ----------
        plant : Plant
            Robot to drive, taken as it is in each segment's recording.
        extra : mapping of str to float, optional
            Small unknowns of the observation that belong to no effect: latency,
            delay_wheels, delay_imu, delay_pose [s], gyro_bias [rad/s]; and corrections of the
            start of a segment, such as ``initial_forward@drive/3`` [m/s].

        Returns
        -------
        numpy.ndarray, shape (n_values,)

        """
        given = extra or {}
        grids = self.simulate(plant, given.get('latency', 0.0), self.corrections(given))
        return self.observe(plant, grids, given)

    def corrections(self, extra: Mapping[str, float]) -> FloatArray | None:
        """
        Return the corrections of the starts among the unknowns of the observation.

        Parameters
        ----------
        extra : mapping of str to float
            As in :meth:`predict`.

        Returns
        -------
        numpy.ndarray, shape (n_segments, 4), or None
            In the order of :data:`~lg_husky_sim.identification.fit_segments.CORRECTIONS`; None if
            there is none.

        """
        if not any('@' in name for name in extra):
            return None
        return np.array([[extra.get(correction_name(segment, place), 0.0)
                          for place in range(len(CORRECTIONS))] for segment in self.segments])

    def simulate(self, plant: Plant, latency: float = 0.0,
                 corrections: FloatArray | None = None, known: Simulated | None = None
                 ) -> tuple[FloatArray, ...]:
        """
        Simulate every segment.

        Parameters
        ----------
        plant : Plant
            Robot to drive, taken as it is in each segment's recording.
        latency : float
            Further dead time of the commands [s].
        corrections : numpy.ndarray, shape (n_segments, 4), optional
            Of the measured starts.
        known : tuple, optional
            Corrections and their grids, of this plant and latency: a segment whose corrections
            are the same is not simulated again.

        Returns
        -------
        tuple of numpy.ndarray, shape (count + 1, 15)
            The kernel's columns, a segment each.

        """
        simulators: dict[tuple[PlantSet, ...], Simulator] = {}
        grids = []
        for place, segment in enumerate(self.segments):
            own = None if corrections is None else corrections[place]
            if known is not None and own is not None and np.array_equal(own, known[0][place]):
                grids.append(known[1][place])
                continue
            here = self.plant_in(plant, segment.recording)
            if here.sets not in simulators:
                simulators[here.sets] = Simulator(here, PERIOD, fine_pose=False)
            grids.append(simulate_segment(simulators[here.sets], segment, latency, own))
        return tuple(grids)

    def observe(self, plant: Plant, grids: Sequence[FloatArray],
                extra: Mapping[str, float] | None = None) -> FloatArray:
        """
        Return what the sensors read of simulated segments.

        Parameters
        ----------
        plant : Plant
            That was simulated; its sensors read.
        grids : sequence of numpy.ndarray
            Of :meth:`simulate`.
        extra : mapping of str to float, optional
            As in :meth:`predict`.

        Returns
        -------
        numpy.ndarray, shape (n_values,)

        """
        parts = [_observe(segment, self.plant_in(plant, segment.recording), grid, extra or {})
                 for segment, grid in zip(self.segments, grids, strict=True)]
        return np.concatenate(parts) if parts else np.zeros(0)

    @cached_property
    def recordings(self) -> tuple[str, ...]:
        """Names of the recordings in their order."""
        return tuple(dict.fromkeys(segment.recording for segment in self.segments))

    def plant_in(self, plant: Plant, recording: str) -> Plant:
        """Return a plant as it is in one of the recordings."""
        onset = plant.onset
        return plant if onset is None else plant.in_recording(
            recording, onset.before(self.recordings))


def _observe(segment: FitSegment, plant: Plant, grid: FloatArray, extra: Mapping[str, float]
             ) -> FloatArray:
    rates = grid[:, _COLUMN['yaw_rate']]
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (rates[1:] + rates[:-1])) * PERIOD])
    parts = []
    for channel in segment.channels:
        seen = [_seen(channel, segment, grid, angle, one.sensors, extra) for one in plant.sets]
        value = seen[0]
        if len(seen) > 1 and plant.onset is not None:
            value = np.where(late_mask(plant, segment, channel.times), seen[1], seen[0])
        parts.append(value)
    return np.concatenate(parts) if parts else np.zeros(0)


def late_mask(plant: Plant, segment: FitSegment, times: FloatArray) -> NDArray[np.bool_]:
    """
    Return at which stamps the late effects of a plant are on.

    Parameters
    ----------
    plant : Plant
        With an onset, or without one.
    segment : FitSegment
        Its pose says where the robot was.
    times : numpy.ndarray, shape (n,)
        On the recording's clock [s].

    Returns
    -------
    numpy.ndarray of bool, shape (n,)

    """
    x = np.full(times.size, np.nan) if segment.pose is None else np.interp(
        times, segment.pose.times, segment.pose.column('x'))
    return plant.late(times, x)


def _seen(channel: Channel, segment: FitSegment, grid: FloatArray, angle: FloatArray,
          sensors: SensorModel, extra: Mapping[str, float]) -> FloatArray:
    start, name = segment.start, channel.name
    if name in ('wheel_left', 'wheel_right'):
        late = sensors.delay_wheels + extra.get('delay_wheels', 0.0)
        factor = sensors.encoder_left if name == 'wheel_left' else sensors.encoder_right
        ends = channel.times - late
        if segment.sampled:
            return factor * sample(grid[:, _COLUMN[name]], start, ends)
        angles = grid[:, _COLUMN[name.replace('wheel', 'angle')]]
        return factor * (sample(angles, start, ends) - sample(
            angles, start, ends - ENCODER_WINDOW)) / ENCODER_WINDOW
    if name == 'yaw_rate':
        late = sensors.delay_imu + extra.get('delay_imu', 0.0)
        rate = sample(grid[:, _COLUMN[name]], start, channel.times - late)
        return sensors.gyro_factor * rate + sensors.gyro_bias + extra.get('gyro_bias', 0.0)
    late = sensors.delay_pose + extra.get('delay_pose', 0.0)
    span = channel.times - channel.begins
    turn = (sample(angle, start, channel.times - late)
            - sample(angle, start, channel.begins - late))
    if name == 'turn':
        return turn / span
    distance = grid[:, _COLUMN['distance']]
    way = (sample(distance, start, channel.times - late)
           - sample(distance, start, channel.begins - late))
    chord: FloatArray = way * np.sinc(turn / (2.0 * np.pi)) / span
    return chord


def observations(segments: Sequence[Segment], settle: float = SETTLE) -> Observations:
    """
    Prepare segments.

    Parameters
    ----------
    segments : sequence of Segment
        Of all recordings that are fitted.
    settle : float
        Data after the start of a moving segment that are not used [s].

    Returns
    -------
    Observations

    Raises
    ------
    RecordingError
        If none of them can be used.

    """
    usable = tuple(one for one in (segment_for_fit(s, settle) for s in segments)
                   if one is not None)
    if not usable:
        names = ', '.join(sorted({s.recording for s in segments})) or 'nothing'
        raise RecordingError(
            f'no usable segment in {names}: a segment needs commands, {2 * SETTLE:g} s of data '
            'and wheel rates, a gyro or a pose')
    return Observations(usable)
