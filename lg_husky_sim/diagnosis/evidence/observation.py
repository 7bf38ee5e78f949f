# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
What the sensors of a drive would have read of a simulated motion.

Places are led along the measured heading: an error of the simulated heading would otherwise turn
the whole way behind it, and a residual of place is meant to tell of speed. Wheel rates are
differences of angles over the time in which an encoder counts, or followed by a low pass, or both:
a mean over W behind a low pass y of a time constant T is the difference over W of the angle's, and
that of an angle a is ``a - T y``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import blake2b
import math

from lg_husky_sim.diagnosis.evidence.chained_places import chained
from lg_husky_sim.diagnosis.evidence.counted_angles import counted, shares
from lg_husky_sim.diagnosis.evidence.drives import Channel, Drive
from lg_husky_sim.diagnosis.evidence.low_pass import followed_by_message, low_passed
from lg_husky_sim.diagnosis.evidence.measured_place import (
    acts_at,
    is_measured,
    legs_of,
    measured_x,
)
from lg_husky_sim.diagnosis.evidence.reading import Reading, smoothing_share, WheelReading
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.plant import Plant, PlantSet, SensorModel
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.simulation.events import COLUMNS, Events, Propagator
from lg_husky_sim.simulation.starting import commanded_until
import numpy as np

#: Numbers of a reading that move readings of different sensors, each only its own: one simulation
#: has the derivatives by all of them. The last two rows do not even need another one.
APART = (('delay_wheels', 'delay_imu', 'delay_pose'), ('wheel_window', 'imu_window'),
         ('gyro_offset', 'pose_turn'), ('gyro_gain', 'pose_lever'))
_WHEELS = (Channel.WHEEL_LEFT, Channel.WHEEL_RIGHT, Channel.ANGLE_LEFT, Channel.ANGLE_RIGHT)
_POSE = (Channel.X, Channel.Y, Channel.HEADING)
_MOVED = {'delay_wheels': _WHEELS, 'wheel_window': _WHEELS, 'delay_pose': _POSE,
          'pose_turn': _POSE, 'pose_lever': _POSE}


def moved_by(name: str, drive: Drive) -> list[slice]:
    """Return where the readings stand that one of the numbers of :data:`APART` moves."""
    return [drive.slice_of(channel) for channel in _MOVED.get(name, (Channel.YAW_RATE,))]


_COLUMN = {name: i for i, name in enumerate(COLUMNS)}


@dataclass(frozen=True, eq=False)
class Wanted:
    """
    When a drive's motion is read, for one way of reading.

    Parameters
    ----------
    events : Events
        Of the drive's commands and all times.
    commands : TimeSeries
        Those, as they act.
    earlier : (TimeSeries, Events) or None
        Commands before the start, as they act, of a drive that begins in motion.
    parts : mapping of str to slice
        Rows of ``wheels``, ``begins`` (windows' ends and begins), ``imu``, ``pose``, ``probe``.
    spans : numpy.ndarray, shape (n_wheels,)
        Lengths of the windows [s].

    """

    events: Events
    commands: TimeSeries
    earlier: tuple[TimeSeries, Events] | None
    parts: Mapping[str, slice]
    spans: FloatArray


@dataclass(frozen=True, eq=False)
class Motion:
    """
    A simulated drive where its sensors read it.

    Parameters
    ----------
    times, rows : numpy.ndarray, shapes (n,), (n, 15)
        Times [s], and the columns of the kernel then.
    wanted, plant, drive : Wanted, Plant, Drive
    delay : float
        How late the stamps of its pose are [s].

    """

    times: FloatArray
    rows: FloatArray
    wanted: Wanted
    plant: Plant
    drive: Drive
    delay: float

    def column(self, name: str, part: str) -> FloatArray:
        """Return one column of the kernel at some of the times."""
        return self.rows[self.wanted.parts[part], _COLUMN[name]]

    def late(self) -> np.typing.NDArray[np.bool_]:
        """Return where the plant's second set acts."""
        onset = self.plant.onset
        if onset is not None and is_measured(self.drive, onset):
            return acts_at(self.drive, onset, self.times, self.delay)
        return self.plant.late(self.times, self.rows[:, _COLUMN['x']])

    def shares(self, part: str) -> FloatArray:
        """Return for how much of the time since the one before it acts, of some of the times."""
        times, onset = self.times[self.wanted.parts[part]], self.plant.onset
        return np.zeros(times.size) if onset is None else shares(onset, times, measured_x(
            self.drive, times, self.delay) if is_measured(self.drive, onset) else self.column(
                'x', part))


def probe_times(drive: Drive) -> FloatArray:
    """Return evenly spaced times at which the motion of a drive is looked at between sensors."""
    count = max(2, int(np.ceil((drive.end - drive.start) / setting('probe_spacing'))) + 1)
    return np.linspace(drive.start, drive.end, count)


def command_lag(drive: Drive, reading: Reading) -> float:
    """Return how late the commands of a drive act [s]."""
    return sum(reading.get(name) for name in ('command_delay', drive.late, drive.own_lag))


def _wanted(drive: Drive, reading: Reading, delays: tuple[float, ...], probe: bool) -> Wanted:
    acting = drive.commands.times + command_lag(drive, reading)
    wheels: FloatArray = drive.wheel_times - delays[0]
    imu: FloatArray = drive.imu_times - delays[1]
    pose: FloatArray = drive.pose_times - delays[2]
    window = max(reading.get('wheel_window'), setting('shortest_window'))
    ends: FloatArray = wheels
    begins: FloatArray = wheels
    if drive.counted:
        begins = wheels[:0]
    elif reading.wheels is WheelReading.FILTERED:
        begins = wheels[:0]
        mean = reading.get('wheel_mean')
        ends = _nodes(drive, np.concatenate([wheels, wheels - mean]) if mean else wheels, acting)
    else:
        ends = wheels + {WheelReading.WINDOW_END: 0.0, WheelReading.WINDOW_MIDDLE: 0.5,
                         WheelReading.WINDOW_START: 1.0}[reading.wheels] * window
        begins = ends - window
    imu_begins = imu[:0]
    if reading.imu == math.inf and imu.size > 3:
        imu = _nodes(drive, imu, acting)
    elif reading.imu is not None and imu.size > 3:
        window = reading.values.get('imu_window', float(np.median(np.diff(drive.imu_times))))
        imu = imu + reading.imu * window
        imu_begins = imu - window
    groups = {'wheels': ends, 'begins': begins, 'imu': imu, 'pose': pose,
              'imu_begins': imu_begins, 'probe': probe_times(drive) if probe else ends[:0]}
    parts, place = {}, 0
    for name, times in groups.items():
        parts[name] = slice(place, place + times.size)
        place += times.size
    times = np.maximum(np.concatenate(list(groups.values())), drive.start)
    commands = drive.commands
    if drive.earlier is not None:
        # The command in force at the start came at its own time.
        stamps = commands.times > drive.start
        commands = TimeSeries(np.append(drive.earlier.times, commands.times[stamps]), np.vstack([
            drive.earlier.values, commands.values[stamps]]), commands.names)
    delay = command_lag(drive, reading)
    if delay != 0.0:
        commands = TimeSeries(commands.times + delay, commands.values, commands.names)
    spans = times[parts['wheels']] - times[parts['begins']] if begins.size else begins
    return Wanted(Events(commands, times, start=drive.start), commands, _before(drive, delay),
                  parts, spans)


def _before(drive: Drive, delay: float) -> tuple[TimeSeries, Events] | None:
    # What was commanded before the start, and when it is left.
    if drive.earlier is None:
        return None
    earlier = TimeSeries(drive.earlier.times + delay, drive.earlier.values, drive.earlier.names)
    return earlier, Events(earlier, [drive.start], start=float(drive.earlier.times[0]))


def _nodes(drive: Drive, stamps: FloatArray, commands: FloatArray) -> FloatArray:
    # Times at which a low pass looks at what it follows: the stamps, where a command acts, which
    # is where an acceleration jumps, and some between.
    step = setting('filter_step')
    first = max(drive.start, float(np.min(stamps)) if stamps.size else drive.start)
    last = max(drive.end, float(np.max(stamps)) if stamps.size else drive.end)
    even = drive.start + step * np.arange(int(np.ceil((last - drive.start) / step)) + 1)
    acting = commands[(commands > first) & (commands < last)]
    return np.asarray(np.unique(np.maximum(np.concatenate(
        [even, stamps, acting, acting + 0.25 * step]), drive.start)), dtype=np.float64)


def simulate(plant: Plant, drive: Drive, reading: Reading, probe: bool = False) -> Motion:
    """
    Drive a plant with the commands of a drive.

    Parameters
    ----------
    plant : Plant
        As it is in the drive's recording.
    drive : Drive
        Says when commands act and when sensors read.
    reading : Reading
        How the log was made: its delays and the windows of its rates.
    probe : bool
        Whether to look at the motion at :func:`probe_times`, too.

    Returns
    -------
    Motion
        Read at the stamps of the sensors less what the first set of the plant is late.

    """
    sensors = plant.sets[-1].sensors
    delays = (sensors.delay_wheels + reading.get('delay_wheels'),
              sensors.delay_imu + reading.get('delay_imu'),
              sensors.delay_pose + reading.get('delay_pose'))
    # A low pass follows the motion wherever its time constant.
    window = reading.get('wheel_mean' if reading.wheels is WheelReading.FILTERED
                         else 'wheel_window')
    imu_window = reading.values.get('imu_window') if reading.imu != math.inf else 0.0
    key = (reading.wheels, reading.imu, window, imu_window, command_lag(drive, reading), delays,
           probe)
    wanted = drive.memory.remembered('wanted', key, lambda: _wanted(
        drive, reading, delays, probe))
    rows = drive.memory.rows((key, _signature(plant)), lambda: _driven(
        plant, drive, wanted, delays[2]))
    events = wanted.events
    times = events.times
    if events.order is not None:
        times = np.empty_like(events.times)
        times[events.order] = events.times
    return Motion(times, rows, wanted, plant, drive, delays[2])


def _driven(plant: Plant, drive: Drive, wanted: Wanted, delay: float) -> FloatArray:
    # Rows of the kernel.
    kept = plant.__dict__
    # One for all drives: the modes of a plant are found once.
    if '_propagator' not in kept:
        kept['_propagator'] = Propagator(plant)
    propagator: Propagator = kept['_propagator']
    before = commanded_until(drive.start, wanted.commands, drive.twist, drive.wheel_rates)
    twist = drive.twist
    if drive.wheel_rates is not None and not drive.still:
        twist = propagator.twist_without_slip(*drive.wheel_rates)
    state = propagator.initial(drive.pose, twist, drive.start, drive.wheel_rates,
                               drive.wheel_angles, before)
    if wanted.earlier is not None:
        # What the base still does of these, at the start, not long ago.
        earlier, events = wanted.earlier
        state = propagator.run_in(events, propagator.initial(
            drive.pose, twist, events.start, drive.wheel_rates, drive.wheel_angles,
            commanded_until(events.start, earlier, drive.twist, drive.wheel_rates)), state)
    onset = plant.onset
    # An onset of which no effect is left changes nothing.
    legs = legs_of(drive, onset, delay) if (
        onset and len(plant.sets) > 1 and is_measured(drive, onset)) else ()
    return propagator.run(wanted.events, state, fine_pose=False, legs=legs)


def _signature(plant: Plant) -> bytes:
    # Of all that makes a plant move; its sensors do not.
    kept = plant.__dict__
    if '_signature' not in kept:
        parts = [repr((plant.onset, plant.states)).encode()]
        for one in plant.sets:
            parts.append(repr(one.command).encode())
            parts += [array.tobytes() for array in (
                one.a, one.b, one.g, one.h, one.k, one.rows, one.rows_u, one.rows_f, one.laws,
                one.offsets, one.coefficients)]
        kept['_signature'] = blake2b(b'|'.join(parts)).digest()
    found: bytes = kept['_signature']
    return found


def _rate(motion: Motion, drive: Drive, side: str, reading: Reading, late: float) -> FloatArray:
    if reading.wheels is WheelReading.FILTERED:
        return _followed(motion, f'wheel_{side}', f'angle_{side}', 'wheels',
                         drive.wheel_times - late, reading.get('wheel_window'),
                         reading.get('wheel_mean'))
    turned = motion.column(f'angle_{side}', 'wheels') - motion.column(f'angle_{side}', 'begins')
    means = _mean_rate(turned, motion.wanted.spans, motion.column(f'wheel_{side}', 'wheels'))
    return followed_by_message(means, smoothing_share(reading, drive.wheel_period))


def _followed(motion: Motion, rate: str, turned: str, part: str, stamps: FloatArray, lag: float,
              mean: float = 0.0) -> FloatArray:
    # Behind a low pass, of the moment or over the mean of a window.
    times, angles = motion.times[motion.wanted.parts[part]], motion.column(turned, part)
    followed = low_passed(times, motion.column(rate, part), angles, max(lag, 1e-6))
    ends = np.searchsorted(times, np.maximum(stamps, times[0]))
    found: FloatArray = followed[ends]
    if mean:
        begins = np.searchsorted(times, np.maximum(stamps - mean, times[0]))
        behind = angles - lag * followed
        found = _mean_rate(behind[ends] - behind[begins], times[ends] - times[begins], found)
    return found


def _yaw_rate(motion: Motion, drive: Drive, reading: Reading, late: float) -> FloatArray:
    # Of the moment, or the mean over a window, or behind a low pass.
    if reading.imu == math.inf and drive.imu_times.size > 3:
        return _followed(motion, 'yaw_rate', 'heading', 'imu', drive.imu_times - late,
                         reading.get('imu_window'))
    parts = motion.wanted.parts
    if parts['imu_begins'].start == parts['imu_begins'].stop:
        return motion.column('yaw_rate', 'imu')
    turned = motion.column('heading', 'imu') - motion.column('heading', 'imu_begins')
    span = motion.times[parts['imu']] - motion.times[parts['imu_begins']]
    return _mean_rate(turned, span, motion.column('yaw_rate', 'imu'))


def _mean_rate(turned: FloatArray, span: FloatArray, rate: FloatArray) -> FloatArray:
    # That of the moment where all of the window is before the drive.
    found: FloatArray = np.where(span > 1e-6, turned / np.maximum(span, 1e-6), rate)
    return found


def observe(motion: Motion, drive: Drive, reading: Reading) -> FloatArray:
    """
    Return what the sensors of a drive would have read.

    Parameters
    ----------
    motion : Motion
        A simulation of the drive with the same reading.
    drive : Drive
        Says when which channel was read.
    reading : Reading
        How the log was made: its delays and the windows of its rates.

    Returns
    -------
    numpy.ndarray, shape (n,)
        In the order of ``drive.measured``.

    """
    sets = motion.plant.sets
    if len(sets) == 1 or sets[0].sensors == sets[1].sensors:
        return _observed(motion, drive, reading, sets[-1].sensors, sets[-1:])
    # A sensor that changes during a drive: read both ways, each with its own delays.
    late = _observed(motion, drive, reading, sets[1].sensors, sets)
    before = replace(motion.plant, sets=(sets[0], replace(sets[1], sensors=sets[0].sensors)))
    early = _observed(simulate(before, drive, reading), drive, reading, sets[0].sensors, sets)
    return np.where(_on(motion, drive), late, early)


def _on(motion: Motion, drive: Drive) -> np.typing.NDArray[np.bool_]:
    order = np.argsort(motion.times, kind='stable')
    at = np.interp(drive.times, motion.times[order], motion.late()[order].astype(np.float64))
    return np.asarray(at > 0.5, dtype=np.bool_)


def _observed(motion: Motion, drive: Drive, reading: Reading, sensors: SensorModel,
              sets: Sequence[PlantSet]) -> FloatArray:
    # As sensors read it; encoders count on by the factors of all sets, whatever they read now.
    out = np.empty(drive.measured.size)
    if drive.wheel_times.size:
        for offset, side in enumerate(('left', 'right')):
            factor = sensors.encoder_left if side == 'left' else sensors.encoder_right
            if drive.counted:
                out[drive.slice_of(Channel(Channel.ANGLE_LEFT + offset))] = counted(
                    motion.column(f'angle_{side}', 'wheels'), drive.wheel_angles[offset],
                    [getattr(one.sensors, f'encoder_{side}') for one in sets],
                    motion.shares('wheels'))
            else:
                out[drive.slice_of(Channel(offset))] = factor * _rate(
                    motion, drive, side, reading,
                    sensors.delay_wheels + reading.get('delay_wheels'))
    if drive.imu_times.size:
        out[drive.slice_of(Channel.YAW_RATE)] = (
            sensors.gyro_factor * (1.0 + reading.get('gyro_gain')) * _yaw_rate(
                motion, drive, reading, sensors.delay_imu + reading.get('delay_imu'))
            + sensors.gyro_bias + reading.get('gyro_offset'))
    if drive.pose_times.size:
        out[drive.slice_of(Channel.HEADING)] = motion.column('heading', 'pose')
        x, y = chained(drive, motion.column('distance', 'pose'), reading)
        out[drive.slice_of(Channel.X)] = x
        out[drive.slice_of(Channel.Y)] = y
    return out
