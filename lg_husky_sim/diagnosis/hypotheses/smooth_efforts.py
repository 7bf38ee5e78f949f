# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Efforts that are smooth functions of some quantity, at some balance: physics without a name.

An effort is a sum of hat functions of a quantity q, ``f(q) = sum c_k hat_k(q)`` with independent
Gaussian c_k, or of responses to a past motion (:mod:`.past_motion`). One that varies freely in
time is none: that is what noise does, whatever its spectrum. With the whitened responses C of the
hats (the numbers of the base projected out) and what is left e, its log evidence against no
effort, at the likeliest size s, is::

    max over s of  b' (G + I/s^2)^-1 b / 2 - ln det(I + s^2 G) / 2,   G = C'C,  b = C'e

with the variance of the innovations along C as the effort leaves them, not that of white ones. The
errors of a gyro or an encoder as a function of what it reads, and those of a gyro that feels an
acceleration, are looked for in the same way, and so are some in proportion to a rate, ``f(q)``
times it: losses that fade, as of grease that is cold at first, with the time since the start as q;
losses of patches of the floor, with both coordinates, over the products of hat functions of both;
what holds for a while after a standstill, with the time since then and the sense of the rate; and
sensors whose factor depends on where they look, with the heading or the angle of a wheel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from lg_husky_sim.diagnosis.evidence.dispersion import dispersion
from lg_husky_sim.diagnosis.evidence.drives import Channel
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.evidence.noise import Whitener
from lg_husky_sim.diagnosis.evidence.observation import Motion, probe_times
from lg_husky_sim.diagnosis.evidence.whitener import respond
from lg_husky_sim.diagnosis.hypotheses.hat_functions import products_of_hats
from lg_husky_sim.diagnosis.hypotheses.past_motion import PAST, responses
from lg_husky_sim.diagnosis.selection.screening import Projection
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Balances: number of the effort in the deviation model, name of the description, its side,
#: subsystem, unit.
BALANCES = {
    'force': (0, 'smooth_force', 'none', 'translation', 'N'),
    'moment': (1, 'smooth_moment', 'none', 'rotation', 'N·m'),
    'torque_left': (2, 'smooth_torque', 'left', 'drivetrain', 'N·m'),
    'torque_right': (3, 'smooth_torque', 'right', 'drivetrain', 'N·m'),
}
#: Quantities that an effort at the chassis and one at the wheels may be a function of.
CHASSIS = ('forward', 'yaw', 'acceleration', 'heading', 'x', 'y', 'time')
ARGUMENTS = {'force': (*CHASSIS, 'past_forward', 'past_direction', 'fading_forward',
                       'patches_forward', 'starting_forward'),
             'moment': (*CHASSIS, 'past_yaw', 'past_turn', 'fading_yaw', 'patches_yaw',
                        'starting_yaw'),
             **dict.fromkeys(('torque_left', 'torque_right'), (
                 'wheel_rate', 'angle', 'wheel_acceleration', 'time', 'past_wheel_rate',
                 'driving_current', 'fading_wheel_rate', 'starting_wheel_rate'))}
#: Those in proportion to a rate: their quantities, the rate, and both in words.
RATED: dict[str, tuple[tuple[str, ...], str, str, str]] = {
    **{f'fading_{rate}': (('since_start',), rate, rate.replace('_', ' '), (
        'the time since the start')) for rate in ('forward', 'yaw', 'wheel_rate')},
    **{f'patches_{rate}': (('x', 'y'), rate, rate, 'the place') for rate in ('forward', 'yaw')},
    **{f'starting_{rate}': ((f'since_{rate}',), f'sense_{rate}', 'the sense of motion', (
        'the time since a standstill')) for rate in ('forward', 'yaw', 'wheel_rate')},
    # What helps forwards helps backwards.
    'driving_current': (('driving_current',), 'sense_wheel_rate', 'the sense of motion', (
        'driving current')),
    'heading_yaw': (('heading',), 'yaw', 'yaw', 'heading'),
    'angle_wheel_rate': (('angle',), 'wheel_rate', 'wheel rate', 'the angle of the wheel'),
}
#: What a gyro may feel beside what it reads.
FELT = ('acceleration', 'lateral_acceleration')
#: The same of readings, whose errors may follow what they are readings of, or what a sensor feels
#: beside it: channels, side, and the quantities of each.
READINGS = {
    'gyro': ((Channel.YAW_RATE,), 'none', ('yaw', *FELT, 'heading_yaw')),
    'encoder_left': ((Channel.WHEEL_LEFT, Channel.ANGLE_LEFT), 'left', (
        'wheel_rate', 'angle_wheel_rate')),
    'encoder_right': ((Channel.WHEEL_RIGHT, Channel.ANGLE_RIGHT), 'right', (
        'wheel_rate', 'angle_wheel_rate')),
}
#: Quantities that have no side.
_COMMON = ('time', 'since_start')
#: Quantities that come round.
_ROUND = ('heading', 'angle')


@dataclass(frozen=True, eq=False)
class Effort:
    """
    A smooth effort, or error of a sensor, as the data have it.

    Parameters
    ----------
    balance : str
        Key of :data:`BALANCES` or :data:`READINGS`.
    argument : str
        Quantity that it is a function of.
    evidence : float
        Log evidence against no effort, of innovations that are not quite white [nats].
    explained : float
        The same of white ones: what it explains beside an effect.
    values, deviations : numpy.ndarray, shape (n_knots,)
        At evenly spaced knots over the range of the quantity [unit of the balance]; of a past
        motion what a second of its signal does.
    largest : float
        Largest size in these drives [unit of the balance].

    """

    balance: str
    argument: str
    evidence: float
    explained: float
    values: FloatArray
    deviations: FloatArray
    largest: float

    @property
    def subsystem(self) -> str:
        """Part of the robot that the balance belongs to."""
        return 'sensor' if self.balance in READINGS else BALANCES[self.balance][3]


def quantities(evidence: Evidence, motions: Sequence[Motion]) -> list[dict[str, FloatArray]]:
    """
    Return what an effort may be a function of, at the probe times of each drive.

    Headings and places are the measured ones where there are any. The driving current of a motor
    is positive while it drives the wheels and negative while it brakes them.
    """
    found = []
    before = 0.0
    begun: dict[str, float] = {}
    for drive, motion in zip(evidence.drives, motions, strict=True):
        times = probe_times(drive)
        forward, yaw = motion.column('forward', 'probe'), motion.column('yaw_rate', 'probe')
        one = {'forward': forward, 'yaw': yaw, 'acceleration': np.gradient(forward, times),
               'heading': np.mod(motion.column('heading', 'probe'), 2.0 * np.pi),
               'x': motion.column('x', 'probe'), 'y': motion.column('y', 'probe'),
               'time': before + times - drive.start, 'lateral_acceleration': forward * yaw,
               'since_start': times - begun.setdefault(drive.recording, drive.start)}
        one |= started(times, forward, 'forward', setting('turning_forward'))
        one |= started(times, yaw, 'yaw', setting('turning_yaw'))
        before += drive.end - drive.start
        if drive.pose_times.size:
            one['heading'] = np.mod(np.interp(times, drive.pose_times, drive.heading),
                                    2.0 * np.pi)
            for name, channel in (('x', Channel.X), ('y', Channel.Y)):
                one[name] = np.interp(times, drive.pose_times,
                                      drive.measured[drive.slice_of(channel)])
        for side in ('left', 'right'):
            rate = motion.column(f'wheel_{side}', 'probe')
            one[f'wheel_rate_{side}'] = rate
            one |= started(times, rate, f'wheel_rate_{side}', setting('turning_wheel'))
            sense = one[f'sense_wheel_rate_{side}']
            one[f'driving_current_{side}'] = sense * motion.column(f'current_{side}', 'probe')
            one[f'wheel_acceleration_{side}'] = np.gradient(rate, times)
            one[f'angle_{side}'] = np.mod(motion.column(f'angle_{side}', 'probe'), 2.0 * np.pi)
        found.append(one)
    return found


def started(times: FloatArray, rate: FloatArray, name: str, least: float
            ) -> dict[str, FloatArray]:
    """
    Return the sense of a rate and the time since it was none.

    Parameters
    ----------
    times, rate : numpy.ndarray, shape (n,)
        [s], [rate]
    name : str
        Of the rate.
    least : float
        Rate from which the sense is certain; half of it, or a change of the sense, is a standstill
        [rate].

    Returns
    -------
    dict of str to numpy.ndarray, shape (n,)
        ``sense_<name>``, from -1 to 1, and ``since_<name>`` [s], at most `longest_past`.

    """
    still = np.abs(rate) < 0.5 * least
    still[1:] |= rate[1:] * rate[:-1] < 0.0
    longest = setting('longest_past')
    last = np.maximum.accumulate(np.where(still, times, times[0] - longest))
    return {f'sense_{name}': np.clip(rate / least, -1.0, 1.0),
            f'since_{name}': np.minimum(times - last, longest)}


def log_evidence(normal: FloatArray, slope: FloatArray) -> tuple[float, FloatArray, FloatArray]:
    """
    Return the log evidence of columns with Gaussian coefficients of the likeliest size.

    Parameters
    ----------
    normal : numpy.ndarray, shape (k, k)
        Products of the columns.
    slope : numpy.ndarray, shape (k,)
        Products of the columns and the target.

    Returns
    -------
    float
        [nats]
    numpy.ndarray, shape (k,)
        Coefficients.
    numpy.ndarray, shape (k,)
        Their standard deviations.

    """
    values, vectors = np.linalg.eigh(normal)
    values = np.maximum(values, 0.0)
    turned = vectors.T @ slope
    largest = float(values[-1]) if values.size else 0.0
    if largest <= 0.0:
        return 0.0, np.zeros(slope.size), np.zeros(slope.size)
    best, size = 0.0, 1e-3 / largest
    for power in np.linspace(-3.0, 8.0, 45):
        square = 10.0 ** power / largest
        gain = 0.5 * float(np.sum(turned ** 2 / (values + 1.0 / square))
                           - np.sum(np.log1p(square * values)))
        if gain > best:
            best, size = gain, square
    spread = 1.0 / (values + 1.0 / size)
    return best, vectors @ (turned * spread), np.sqrt((vectors ** 2) @ spread)


def beyond_chance(evidence: Evidence, fit: Fit, projection: Projection, columns: FloatArray,
                  *, overwrite: bool = False) -> tuple[float, float, FloatArray, FloatArray]:
    """
    Return the log evidence of columns where innovations are not quite white.

    Parameters
    ----------
    evidence : Evidence
        Says which innovations lie in one block of time.
    fit : Fit
        Whose innovations the columns may explain.
    projection : Projection
        Of the fit.
    columns : numpy.ndarray, shape (n, k)
        Whitened responses.
    overwrite : bool
        Whether they are not needed any more.

    Returns
    -------
    float
        With the variance of what the columns leave: of G and b over the dispersion [nats].
    float
        As if they were white [nats].
    numpy.ndarray, numpy.ndarray
        Coefficients and their standard deviations, as of :func:`log_evidence`.

    """
    normal, slope = projection.problem(columns)
    explained, values, deviations = log_evidence(normal, slope)
    if explained <= 0.0:
        return 0.0, 0.0, values, deviations
    left = projection.apart(columns, overwrite=overwrite)
    spread = dispersion(evidence, fit.whitened - left @ values, left)
    gain, values, deviations = log_evidence(normal / spread, slope / spread)
    return gain, explained, values, deviations


def efforts(evidence: Evidence, fit: Fit) -> tuple[Effort, ...]:
    """
    Look for smooth efforts in what a fit leaves.

    Parameters
    ----------
    evidence : Evidence
        Drives, and the noise under which the fit was made.
    fit : Fit
        What it leaves of the recordings is searched.

    Returns
    -------
    tuple of Effort
        Largest evidence first.

    """
    motions = evidence.motions(fit.point, True)
    known = quantities(evidence, motions)
    projection = Projection(fit)

    def span(quantity: str, name: str) -> tuple[float, float]:
        pooled = np.concatenate([one[name] for one in known])
        return (0.0, 2.0 * np.pi) if quantity in _ROUND else (
            float(np.min(pooled)), float(np.max(pooled)))

    def one_of(task: tuple[str, str]) -> Effort | None:
        balance, argument = task
        side = READINGS[balance][1] if balance in READINGS else BALANCES[balance][2]
        over, rate, *_ = RATED.get(argument, (
            (PAST[argument][0] if argument in PAST else argument,), ''))
        sided = [q if side == 'none' or q in _COMMON else f'{q}_{side}' for q in (*over, rate)]
        names, own_rate = sided[:-1], sided[-1]
        ranges = [span(*pair) for pair in zip(over, names, strict=True)]
        count = int(setting('smooth_knots' if len(over) == 1 else 'patch_knots'))
        parts, shapes = [], []
        for one, whitener in zip(known, evidence.whiteners, strict=True):
            values = [one[name] for name in names]
            shape = responses(
                values[0], probe_times(whitener.frame.drive), argument, count
            ) if argument in PAST else products_of_hats(values, ranges, count)
            if rate:
                shape *= one[own_rate][:, None]
            shapes.append(shape)
            parts.append(whitener.apply(
                _misread(whitener, balance, shape) if balance in READINGS else
                moved_by(whitener, BALANCES[balance][0], shape)))
        columns = np.concatenate(parts)
        # Nothing is known of knots where no drive has been.
        seen = np.any(columns, axis=0)
        if not np.any(seen):
            return None
        columns, shapes = columns[:, seen], [shape[:, seen] for shape in shapes]
        gain, explained, sizes, deviations = beyond_chance(evidence, fit, projection, columns)
        largest = max(float(np.max(np.abs(shape @ sizes))) for shape in shapes)
        return Effort(balance, argument, gain, explained, sizes, deviations, largest)
    tasks = [*((b, a) for b in BALANCES for a in ARGUMENTS[b]),
             *((b, argument) for b, (*_, own) in READINGS.items() for argument in own)]
    found = [one for one in evidence.pool.map(one_of, tasks) if one is not None]
    return tuple(sorted(found, key=lambda e: -e.evidence))


def moved_by(whitener: Whitener, row: int, shape: FloatArray) -> FloatArray:
    """
    Return how efforts move the readings of a drive.

    Parameters
    ----------
    whitener : Whitener
        Of the drive.
    row : int
        Number of the balance in the deviation model.
    shape : numpy.ndarray, shape (n_probe, k)
        The efforts at its probe times.

    Returns
    -------
    numpy.ndarray, shape (n, k)

    """
    frame, drive = whitener.frame, whitener.frame.drive
    pushed = np.zeros((shape.shape[0], 4, shape.shape[1]))
    pushed[:, row] = shape
    out = np.empty((frame.times.size, shape.shape[1]))
    respond(pushed, probe_times(drive), frame.times, drive.channels, frame.order, frame.cosine,
            frame.sine, whitener.model, setting('longest_step'), out)
    return out


def _misread(whitener: Whitener, reading: str, shape: FloatArray) -> FloatArray:
    # Readings of a sensor whose rate is wrong by such shapes over time, shape (n, k).
    drive, times = whitener.frame.drive, probe_times(whitener.frame.drive)
    out = np.zeros((drive.measured.size, shape.shape[1]))
    for channel in READINGS[reading][0]:
        part = drive.slice_of(channel)
        if part.stop > part.start:
            rates = shape if channel not in (Channel.ANGLE_LEFT, Channel.ANGLE_RIGHT) else (
                np.cumsum(shape, axis=0) * (times[1] - times[0]))
            out[part] = np.column_stack([np.interp(
                whitener.frame.times[part], times, rate) for rate in rates.T])
    return out
