# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Segments of recordings as drives: what was commanded, and what each sensor read when."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
import enum
from functools import cached_property
from itertools import pairwise

from lg_husky_sim.diagnosis.evidence.memory import Memory
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.errors import RecordingError
from lg_husky_sim.recording import Recording, Segment, segments
from lg_husky_sim.recording.wheels import unwrapped
from lg_husky_sim.signals import BodyTwist, FloatArray, Pose, TimeSeries
from lg_husky_sim.simulation.starting import at_rest
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded


class Channel(enum.IntEnum):
    """What one number of a drive is a reading of; the value is its code in the whitener."""

    WHEEL_LEFT = 0
    WHEEL_RIGHT = 1
    YAW_RATE = 2
    X = 3
    Y = 4
    HEADING = 5
    ANGLE_LEFT = 6
    ANGLE_RIGHT = 7


#: Units of the channels.
UNITS = {Channel.WHEEL_LEFT: 'rad/s', Channel.WHEEL_RIGHT: 'rad/s', Channel.YAW_RATE: 'rad/s',
         Channel.X: 'm', Channel.Y: 'm', Channel.HEADING: 'rad', Channel.ANGLE_LEFT: 'rad',
         Channel.ANGLE_RIGHT: 'rad'}


@dataclass(frozen=True)
class Clock:
    """
    When a base ticks in one drive, and how much later than that, against the log, commands act.

    Parameters
    ----------
    period, phase, late : float
        [s]

    """

    period: float
    phase: float
    late: float


@dataclass(frozen=True, eq=False)
class Drive:
    """
    One segment, ready to be predicted.

    Parameters
    ----------
    recording : str
    index : int
        Of the segment in its recording.
    start, end : float
        [s] on the recording's clock.
    commands : TimeSeries
        That drive the robot.
    wheel_times, imu_times, pose_times : numpy.ndarray
        Stamps [s]; empty where a stream is missing.
    counted : bool
        Whether the wheels are known as angles only, not as rates.
    measured : numpy.ndarray, shape (n,)
        All readings, channel after channel; headings are unwrapped.
    channels : numpy.ndarray of int, shape (n,)
        :class:`Channel` of each reading.
    times : numpy.ndarray, shape (n,)
        Stamp of each reading [s].
    heading : numpy.ndarray, shape (n_pose,)
        Measured heading, smoothed [rad].
    pose : Pose
        At the start.
    twist : BodyTwist
        At the start.
    wheel_rates, wheel_angles : tuple of float
        At the start, left and right [rad/s], [rad].
    still : bool
        Whether the robot is at rest at the start.
    stamped : bool
        Whether the commands carry stamps of their own, and not only the time of their receipt.
    logged : TimeSeries
        Commands as they were logged, or as a base that ticks applied them.
    rounding : numpy.ndarray, shape (n,)
        Variance by which each reading is rounded [its unit squared].
    clock : Clock, optional
        Of a base that applies commands at its own ticks, not when they come.
    earlier : TimeSeries, optional
        Commands before the start, of a robot that is in motion there.
    jitter : mapping of str to float
        Standard deviation of the logged stamps of a stream from the even ones that took their
        place [s]; empty where none did.
    memory : Memory
        What was worked out about this drive.

    """

    recording: str
    index: int
    start: float
    end: float
    commands: TimeSeries
    wheel_times: FloatArray
    imu_times: FloatArray
    pose_times: FloatArray
    counted: bool
    measured: FloatArray
    channels: NDArray[np.int64]
    times: FloatArray
    heading: FloatArray
    pose: Pose
    twist: BodyTwist
    wheel_rates: tuple[float, float] | None
    wheel_angles: tuple[float, float]
    still: bool
    stamped: bool = True
    logged: TimeSeries = field(kw_only=True)
    rounding: FloatArray = field(kw_only=True)
    clock: Clock | None = None
    earlier: TimeSeries | None = None
    jitter: Mapping[str, float] = field(default_factory=dict)
    memory: Memory = field(default_factory=Memory, init=False, repr=False)

    @property
    def name(self) -> str:
        """Return recording and number of the segment."""
        return f'{self.recording}/{self.index}'

    @property
    def late(self) -> str:
        """Name of how much later than at the likeliest phase the base ticks in its recording."""
        return f'tick_delay {self.recording}'

    @property
    def own_lag(self) -> str:
        """Name of how much later than in other recordings commands act in that of this drive."""
        return f'lag {self.recording}'

    @cached_property
    def wheel_period(self) -> float:
        """Usual time between two readings of the wheels [s]."""
        return float(np.median(np.diff(self.wheel_times))) if self.wheel_times.size > 1 else 0.0

    def slice_of(self, channel: Channel) -> slice:
        """Return where a channel's readings stand; empty where there are none."""
        return self._slices[int(channel)]

    @cached_property
    def _slices(self) -> list[slice]:
        codes = np.arange(len(Channel) + 1)
        return [slice(*pair) for pair in pairwise(
            np.searchsorted(self.channels, codes, side='left').tolist())]


def smoothed(times: FloatArray, values: FloatArray, width: float) -> FloatArray:
    """
    Smooth samples by penalising their second derivative (Whittaker).

    Parameters
    ----------
    times, values : numpy.ndarray, shape (n,)
        Stamps [s], about evenly spaced, and the samples in any unit.
    width : float
        Time over which it smooths [s].

    Returns
    -------
    numpy.ndarray, shape (n,)

    """
    n = times.size
    if n < 4:
        return np.array(values)
    step = float(np.median(np.diff(times)))
    penalty = (width / (2.0 * np.pi * max(step, 1e-6))) ** 4
    bands = np.zeros((3, n))
    bands[2] = 1.0
    coefficients = np.array([1.0, -2.0, 1.0])
    for i in range(3):
        for j in range(i, 3):
            bands[2 - (j - i), j:n - 2 + j] += penalty * coefficients[i] * coefficients[j]
    return np.asarray(solveh_banded(bands, values), dtype=np.float64)


def _usable(series: TimeSeries | None) -> TimeSeries | None:
    # Every n-th reading of a stream that is faster than what tells more; none of one that is too
    # short to be compared.
    if series is None or len(series) < 4 or not np.all(np.isfinite(series.values)):
        return None
    step = float(np.median(np.diff(series.times)))
    stride = max(1, int(np.ceil(1.0 / (max(step, 1e-6) * setting('fastest')) - 1e-6)))
    return TimeSeries(series.times[::stride], series.values[::stride], series.names)


def are_derived(rates: TimeSeries, angles: TimeSeries) -> bool:
    """Return whether reading made the rates of the angles: they are no measurement then."""
    # They are in the middle between the angles' stamps.
    middles = 0.5 * (angles.times[:-1] + angles.times[1:])
    return len(rates) > 3 and bool(np.mean(np.isin(rates.times, middles)) > 0.5)


def _rounding(values: FloatArray) -> FloatArray:
    # q^2/12, with the least step q between neighbours but for stray ones: of readings that are
    # rounded, what they are rounded to; of others next to nothing. Readings that repeat each other
    # are off by the same, and tell as much as one.
    steps = np.abs(np.diff(values))
    moved = steps > 0.0
    if not np.any(moved):
        return np.zeros(values.size)
    quantum = float(np.quantile(steps[moved], setting('least_steps')))
    run = np.concatenate([[0], np.cumsum(moved)])
    return np.asarray(quantum ** 2 / 12.0 * np.bincount(run)[run], dtype=np.float64)


def _early(series: TimeSeries, start: float, names: Sequence[str]) -> list[float]:
    part = series.slice(start, start + setting('start_window'))
    values = part if len(part) else series
    return [float(np.median(values.column(name)[:12])) for name in names]


def drive_of(segment: Segment, stamped: bool = True) -> Drive | None:
    """
    Prepare a segment.

    Parameters
    ----------
    segment : Segment
        Commands and what was measured, without a gap.
    stamped : bool
        Whether the commands carry stamps of their own.

    Returns
    -------
    Drive or None
        None where it has no command, nothing measured, or is too short.

    """
    streams = segment.streams
    if 'command' not in streams or segment.duration < setting('shortest_segment'):
        return None
    start = segment.start
    wheels, imu, pose, angles = (_usable(streams.get(n))
                                 for n in ('wheels', 'imu', 'pose', 'wheel_angles'))
    counted = angles is not None and (
        wheels is None or are_derived(streams['wheels'], streams['wheel_angles']))
    turning = angles if counted else wheels
    pieces: list[tuple[Channel, FloatArray, FloatArray]] = []
    rates: tuple[float, float] | None = None
    if turning is not None:
        first = Channel.ANGLE_LEFT if counted else Channel.WHEEL_LEFT
        for offset, side in enumerate(('left', 'right')):
            values = turning.column(side)
            pieces.append((Channel(int(first) + offset), turning.times,
                           unwrapped(values) if counted else values))
        if not counted:
            left, right = _early(turning, start, ('left', 'right'))
            rates = (left, right)
    yaw, forward = 0.0, 0.0
    heading = np.zeros(0)
    if imu is not None:
        pieces.append((Channel.YAW_RATE, imu.times, imu.column('yaw_rate')))
        yaw = _early(imu, start, ('yaw_rate',))[0]
    if pose is not None:
        raw = np.unwrap(pose.column('heading'))
        heading = smoothed(pose.times, raw, setting('heading_smoothing'))
        pieces += [(Channel.X, pose.times, pose.column('x')),
                   (Channel.Y, pose.times, pose.column('y')), (Channel.HEADING, pose.times, raw)]
        late = int(np.searchsorted(pose.times, pose.times[0] + 2.0 * setting('start_window')))
        late = min(max(late, 1), len(pose) - 1)
        span = float(pose.times[late] - pose.times[0])
        if span > 0.0:
            middle = 0.5 * (heading[1:late + 1] + heading[:late])
            ahead = (np.cos(middle) * np.diff(pose.column('x')[:late + 1])
                     + np.sin(middle) * np.diff(pose.column('y')[:late + 1]))
            forward = _slope(pose.times[:late + 1], np.concatenate([[0.0], np.cumsum(ahead)]))
            yaw = yaw if imu is not None else float((heading[late] - heading[0]) / span)
    if not pieces:
        return None
    pieces.sort(key=lambda piece: int(piece[0]))
    still = at_rest(BodyTwist(forward, yaw), rates) if rates is not None else at_rest(
        BodyTwist(forward, yaw))
    twist = BodyTwist() if still else BodyTwist(forward, yaw)
    place = Pose() if pose is None else _begun(pose, heading, start, twist)
    begin = (0.0, 0.0)
    if counted and turning is not None:
        left, right = (_first(turning.times, unwrapped(turning.column(side)), start, still)
                       for side in ('left', 'right'))
        begin = (left, right)
    elif angles is not None:
        begin = (float(np.interp(start, angles.times, unwrapped(angles.column('left')))),
                 float(np.interp(start, angles.times, unwrapped(angles.column('right')))))
    empty = np.zeros(0)
    return Drive(
        segment.recording, segment.index, start, segment.end, streams['command'],
        empty if turning is None else turning.times, empty if imu is None else imu.times,
        empty if pose is None else pose.times, counted,
        np.concatenate([v for _, _, v in pieces]),
        np.concatenate([np.full(t.size, int(c), dtype=np.int64) for c, t, _ in pieces]),
        np.concatenate([t for _, t, _ in pieces]), heading, place,
        twist, (0.0, 0.0) if still else rates,
        begin, still, stamped, logged=streams['command'],
        rounding=np.concatenate([_rounding(v) for _, _, v in pieces]))


def _slope(times: FloatArray, values: FloatArray) -> float:
    since = times - np.mean(times)
    return float(since @ values / (since @ since))


def _begun(pose: TimeSeries, heading: FloatArray, start: float, twist: BodyTwist) -> Pose:
    # Where a drive begins: its first few poses less what the robot has moved until then.
    few = slice(0, min(len(pose), 5))
    since = pose.times[few] - start
    way, middle = twist.forward * since, heading[few] - 0.5 * twist.yaw * since
    return Pose(float(np.median(pose.column('x')[few] - way * np.cos(middle))),
                float(np.median(pose.column('y')[few] - way * np.sin(middle))),
                float(heading[0] - twist.yaw * since[0]))


def _first(times: FloatArray, angles: FloatArray, start: float, still: bool) -> float:
    # The angle of a wheel at the start, of its first readings.
    few = int(np.searchsorted(times, times[0] + setting('start_window')))
    if still or few < 2:
        return float(angles[0])
    return float(np.mean(angles[:few]) - _slope(times[:few], angles[:few]) * (
        np.mean(times[:few]) - start))


def _remembering(drive: Drive, commands: TimeSeries) -> Drive:
    before = commands.slice(drive.start - setting('run_in'), drive.start)
    moved = not drive.still and len(before) > 1
    return replace(drive, earlier=before) if moved else drive


def drives_of(recordings: Sequence[Recording]) -> tuple[Drive, ...]:
    """
    Return all usable drives of recordings.

    Parameters
    ----------
    recordings : sequence of Recording
        Each with commands; their segments become drives.

    Returns
    -------
    tuple of Drive

    Raises
    ------
    RecordingError
        If one has no commands, or nothing that can be compared with a simulation.

    """
    found = []
    for recording in recordings:
        recording.stream('command')
        kind = recording.present.get(recording.topics.get('command', ''), '')
        stamped = kind.endswith('Stamped')
        own = [_remembering(d, recording.streams['command'])
               for d in (drive_of(s, stamped) for s in segments(recording)) if d is not None]
        if not own:
            raise RecordingError(
                f'recording {recording.name} has no stretch of {setting("shortest_segment"):g} s '
                'in which commands and wheels, gyro or pose were all recorded')
        found += own
    return tuple(found)
