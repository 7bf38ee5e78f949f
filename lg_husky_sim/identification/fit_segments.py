# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Recorded segments ready for a fit: what is simulated, and what was measured.

Every channel keeps its own stamps. The pose enters as increments over a window, taken in the
body's frame at mid-heading, so that errors do not accumulate.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

from lg_husky_sim.identification.settings import setting
from lg_husky_sim.recording import Segment
from lg_husky_sim.signals import BodyTwist, FloatArray, TimeSeries
from lg_husky_sim.simulation import starting
import numpy as np

#: Grid of the simulation [s].
PERIOD = 0.01
#: Window of a pose increment [s].
WINDOW = 0.2
#: Time after the start from which its state is taken [s].
EARLY = 0.15
#: Data after the start of a moving segment that are not used [s]: its initial state is unknown.
SETTLE = 0.6
#: The same where the initial state is estimated [s]: what late stamps and the windows of the
#: sensors reach back.
SETTLE_ESTIMATED = EARLY
#: Channels in the order of the measurement vector.
CHANNELS = ('wheel_left', 'wheel_right', 'yaw_rate', 'advance', 'turn')
#: Corrections of the state at the start of a segment: of the base's forward speed [m/s] and yaw
#: rate [rad/s] and of the wheel rates on the left and on the right [rad/s].
CORRECTIONS = ('initial_forward', 'initial_yaw', 'initial_left', 'initial_right')
UNITS = {'wheel_left': 'rad/s', 'wheel_right': 'rad/s', 'yaw_rate': 'rad/s',
         'advance': 'm/s', 'turn': 'rad/s'}


@dataclass(frozen=True, eq=False)
class Channel:
    """
    One channel of one segment.

    Parameters
    ----------
    name : str
        One of :data:`CHANNELS`.
    times : numpy.ndarray, shape (n,)
        Stamps [s] on the recording's clock; for increments, the ends of the windows.
    values : numpy.ndarray, shape (n,)
        Measured; increments are divided by their window [unit of :data:`UNITS`].
    begins : numpy.ndarray, shape (n,)
        For increments, the begins of the windows [s]; else equal to ``times``.

    """

    name: str
    times: FloatArray
    values: FloatArray
    begins: FloatArray


@dataclass(frozen=True, eq=False)
class FitSegment:
    """
    A segment, ready to be simulated.

    Parameters
    ----------
    recording : str
    index : int
        Of the segment in its recording.
    start : float
        Time of the first grid point [s].
    count : int
        Steps of the grid.
    commands : TimeSeries
    channels : tuple of Channel
    pose : TimeSeries or None
        Measured, for the start and the resets.
    twist : BodyTwist
        First guess of the initial velocity.
    wheel_rates : tuple of float
    wheel_angles : tuple of float
        Initial angles [rad]; zero where no positions were recorded.
    measured : tuple of bool
        Whether each number of :attr:`initial_state` was measured at the start.
    turned : TimeSeries or None
        Measured wheel angles, for the resets.
    sampled : bool
        Whether the wheel rates are those of the moment, not means over the time in which an
        encoder counts.

    """

    recording: str
    index: int
    start: float
    count: int
    commands: TimeSeries
    channels: tuple[Channel, ...]
    pose: TimeSeries | None
    twist: BodyTwist
    wheel_rates: tuple[float, float]
    wheel_angles: tuple[float, float]
    measured: tuple[bool, bool, bool, bool] = (True, True, True, True)
    turned: TimeSeries | None = None
    sampled: bool = False

    @property
    def name(self) -> str:
        """Return recording and number of the segment."""
        return f'{self.recording}/{self.index}'

    @property
    def initial_state(self) -> tuple[float, float, float, float]:
        """Measured state at the start, in the order of :data:`CORRECTIONS`."""
        return (self.twist.forward, self.twist.yaw, *self.wheel_rates)

    @property
    def initial_wheel_rates(self) -> tuple[float, float] | None:
        """Measured wheel rates at the start [rad/s]; None where none were."""
        return self.wheel_rates if self.measured[CORRECTIONS.index('initial_left')] else None


def correction_name(segment: FitSegment, place: int) -> str:
    """Return the name of a correction of a segment's start, its place in CORRECTIONS given."""
    return f'{CORRECTIONS[place]}@{segment.name}'


def at_rest(segment: FitSegment) -> bool:
    """Return whether a segment is known to begin at rest: by its wheels or its pose."""
    seen = {channel.name for channel in segment.channels}
    return not any(segment.initial_state) and bool(seen - {'yaw_rate'})


def _thinned(times: FloatArray) -> slice:
    if times.size < 3:
        return slice(None)
    step = float(np.median(np.diff(times)))
    most = setting('fastest_rate')
    return slice(None, None, max(1, math.ceil(1.0 / (step * most)))) if step > 0.0 else slice(None)


def _increments(pose: TimeSeries, start: float) -> tuple[Channel, ...]:
    times = pose.times
    picked = [int(np.searchsorted(times, start, side='left'))]
    while picked[-1] < times.size:
        following = int(np.searchsorted(times, times[picked[-1]] + WINDOW * 0.98, side='left'))
        if following >= times.size:
            break
        picked.append(following)
    if len(picked) < 2:
        return ()
    at = np.array(picked)
    here, there = at[:-1], at[1:]
    near = times[there] - times[here] < 3.0 * WINDOW
    here, there = here[near], there[near]
    x, y, heading = (pose.column(n) for n in ('x', 'y', 'heading'))
    middle = 0.5 * (heading[here] + heading[there])
    span = times[there] - times[here]
    advance = ((x[there] - x[here]) * np.cos(middle) + (y[there] - y[here]) * np.sin(middle))
    return (Channel('advance', times[there], advance / span, times[here]),
            Channel('turn', times[there], (heading[there] - heading[here]) / span, times[here]))


def _initial(series: TimeSeries | None, names: tuple[str, ...], start: float
             ) -> tuple[float, ...]:
    if series is None or not len(series):
        return tuple(0.0 for _ in names)
    early = series.slice(start, start + EARLY)
    values = early if len(early) else series
    return tuple(float(np.median(values.column(n)[:8])) for n in names)


def _measured_at_start(series: TimeSeries | None, start: float) -> bool:
    return series is not None and len(series.slice(start, start + EARLY)) > 0


def segment_for_fit(segment: Segment, settle: float = SETTLE) -> FitSegment | None:
    """
    Prepare a segment.

    Parameters
    ----------
    segment : Segment
        With commands and what was measured.
    settle : float
        Data after the start that are not used where it begins in motion [s].

    Returns
    -------
    FitSegment or None
        None if it is too short or has no command or no measurement.

    """
    streams = segment.streams
    if 'command' not in streams or segment.duration < 2.0 * SETTLE:
        return None
    start = segment.start
    count = math.ceil((segment.end - start) / PERIOD)
    wheels, imu, pose = (streams.get(n) for n in ('wheels', 'imu', 'pose'))
    rates = _initial(wheels, ('left', 'right'), start)
    yaw = _initial(imu, ('yaw_rate',), start)[0]
    wheels_measured, imu_measured = (_measured_at_start(series, start) for series in (wheels, imu))
    channels: list[Channel] = []
    forward, pose_measured = 0.0, False
    if pose is not None and len(pose) > 3:
        increments = _increments(pose, start)
        channels.extend(increments)
        if increments and increments[0].values.size:
            forward = float(increments[0].values[0])
            pose_measured = float(increments[0].begins[0]) <= start + EARLY
            yaw = yaw if imu is not None else float(increments[1].values[0])
    still = (starting.at_rest(BodyTwist(forward, yaw))
             and starting.at_rest(BodyTwist(), (rates[0], rates[1])))
    begin = start if still else start + settle
    if wheels is not None:
        part = _thinned(wheels.times)
        channels = [*(Channel(f'wheel_{side}', wheels.times[part], wheels.column(side)[part],
                              wheels.times[part]) for side in ('left', 'right')), *channels]
    if imu is not None:
        part = _thinned(imu.times)
        channels.append(Channel('yaw_rate', imu.times[part], imu.column('yaw_rate')[part],
                                imu.times[part]))
    kept = tuple(_after(channel, begin) for channel in channels)
    kept = tuple(sorted((c for c in kept if c.values.size > 3),
                        key=lambda c: CHANNELS.index(c.name)))
    if not kept:
        return None
    angles = streams.get('wheel_angles')
    angles = angles if angles is not None and len(angles) else None
    start_angles = (0.0, 0.0)
    if angles is not None:
        start_angles = (float(np.interp(start, angles.times, angles.column('left'))),
                        float(np.interp(start, angles.times, angles.column('right'))))
    return FitSegment(segment.recording, segment.index, start, count, streams['command'], kept,
                      pose if pose is not None and len(pose) > 3 else None,
                      BodyTwist() if still else BodyTwist(forward, yaw),
                      (0.0, 0.0) if still else (rates[0], rates[1]), start_angles,
                      (pose_measured, imu_measured if imu is not None else pose_measured,
                       wheels_measured, wheels_measured), angles)


def _after(channel: Channel, begin: float) -> Channel:
    use = (channel.begins >= begin) & np.isfinite(channel.values)
    return Channel(channel.name, channel.times[use], channel.values[use], channel.begins[use])
