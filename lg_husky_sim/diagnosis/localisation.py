# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Where a model is off: when, in which channel, in which driving, and at which balance.

The missing effort at each balance of the graph over time is the mean of a Gaussian process: hat
functions of time, whose responses are whitened like everything else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

from lg_husky_sim.diagnosis.evidence.drives import Channel, Drive
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.evidence.observation import probe_times
from lg_husky_sim.diagnosis.evidence.whitener import respond
from lg_husky_sim.diagnosis.hypotheses.bursts import burst_evidence, levelled
from lg_husky_sim.diagnosis.hypotheses.hat_functions import hats
from lg_husky_sim.diagnosis.hypotheses.smooth_efforts import BALANCES, beyond_chance
from lg_husky_sim.diagnosis.hypotheses.wheel_bursts import wheel_bursts
from lg_husky_sim.diagnosis.result import Mismatch
from lg_husky_sim.diagnosis.selection.screening import Projection
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Names of the channels in the files, and the part of the robot whose balance each belongs to.
NAMES = {Channel.WHEEL_LEFT: ('wheel_left', 'drivetrain'),
         Channel.WHEEL_RIGHT: ('wheel_right', 'drivetrain'),
         Channel.ANGLE_LEFT: ('wheel_left', 'drivetrain'),
         Channel.ANGLE_RIGHT: ('wheel_right', 'drivetrain'),
         Channel.YAW_RATE: ('yaw_rate', 'rotation'), Channel.X: ('x', 'translation'),
         Channel.Y: ('y', 'translation'), Channel.HEADING: ('heading', 'rotation')}
#: Regimes of driving in words.
WORDS = {'rest': 'at rest', 'straight': 'driving straight',
         'accelerating': 'while the speed changes', 'steady_turn': 'in steady turns',
         'spin': 'turning on the spot', 'reversing': 'in reverse', 'slow': 'at low speed'}


@dataclass(frozen=True, eq=False)
class Missing:
    """
    A missing effort at one balance in one drive, over time.

    Parameters
    ----------
    balance : str
        Key of :data:`BALANCES`.
    drive : Drive
    times, values, deviations : numpy.ndarray, shape (n,)
        [s], mean and standard deviation [unit of the balance].
    evidence : float
        Log evidence of an effort of one size all the time, over all drives, where innovations
        are not quite white [nats]. It says where a model is off, and not that anything is
        missing: noise whose spectrum is not that of the model of it has some as well.
    bursts : float
        Log evidence of an effort that bursts, over all drives [nats]; at the wheels, of rates that
        no command explains.

    """

    balance: str
    drive: Drive
    times: FloatArray
    values: FloatArray
    deviations: FloatArray
    evidence: float
    bursts: float


def steady_knots(drive: Drive, count: int) -> np.typing.NDArray[np.bool_]:
    """
    Return which efforts over time tell of bursts.

    Parameters
    ----------
    drive : Drive
        Its logged commands tell when a command changes.
    count : int
        Evenly spaced knots from its start to its end.

    Returns
    -------
    numpy.ndarray of bool, shape (count,)
        Not those under whose hats a command changes, which may have come late, or never; nor
        those at the start, with a state that nobody has measured.

    """
    knots = np.linspace(drive.start, drive.end, count)
    moved = np.max(np.abs(np.diff(drive.logged.values, axis=0)), axis=1) > setting('still_speed')
    changes = np.append(drive.start, drive.logged.times[1:][moved])
    found: np.typing.NDArray[np.bool_] = np.min(np.abs(
        knots[:, None] - changes[None, :]), axis=1) > knots[1] - knots[0]
    return found


def _speeds(drive: Drive, count: int) -> FloatArray:
    # That are commanded at the knots, of a point beside the middle.
    knots = np.linspace(drive.start, drive.end, count)
    place = np.searchsorted(drive.logged.times, knots, side='right')
    forward, yaw = np.abs(drive.logged.values[np.maximum(place - 1, 0)]).T
    return np.asarray(forward + setting('burst_lever') * yaw, dtype=np.float64)


def missing_efforts(evidence: Evidence, fit: Fit) -> tuple[Missing, ...]:
    """
    Return the missing effort of each balance over time.

    Parameters
    ----------
    evidence : Evidence
        Drives, and the noise under which the fit was made.
    fit : Fit
        Of the model in doubt.

    Returns
    -------
    tuple of Missing
        For each drive and balance.

    """
    projection = Projection(fit)
    spacing = setting('effort_spacing')
    counts = [max(4, min(int((d.end - d.start) / spacing), int(setting('most_knots'))))
              for d in evidence.drives]
    steady = np.concatenate([steady_knots(d, n) for d, n in zip(
        evidence.drives, counts, strict=True)])
    speeds = np.concatenate([_speeds(d, n) for d, n in zip(
        evidence.drives, counts, strict=True)])[steady]

    def at(balance: str) -> list[Missing]:
        columns = _hat_responses(evidence, BALANCES[balance][0], counts)
        if BALANCES[balance][2] == 'none':
            normal, slope = projection.problem(columns)
            bursts = burst_evidence(levelled(
                (slope / np.sqrt(np.maximum(np.diag(normal), 1e-12)))[steady], speeds))
        else:
            # Their efforts burst with every command that comes a little late.
            bursts = wheel_bursts(evidence, fit, BALANCES[balance][2])
        # There are many of them in a long recording.
        gain, _, values, deviations = beyond_chance(evidence, fit, projection, columns,
                                                    overwrite=True)
        ends = np.cumsum(counts)[:-1]
        return [Missing(balance, drive, np.linspace(drive.start, drive.end, size), own, deviation,
                        gain, bursts)
                for size, drive, own, deviation in zip(
                    counts, evidence.drives, np.split(values, ends), np.split(deviations, ends),
                    strict=True)]
    return tuple(chain.from_iterable(evidence.pool.map(at, BALANCES)))


def _hat_responses(evidence: Evidence, row: int, counts: Sequence[int]) -> FloatArray:
    # Whitened, one column a hat of the effort at a balance, of all drives, as many as each has.
    columns = np.zeros((evidence.count, sum(counts)))
    first = top = 0
    for count, drive, whitener in zip(counts, evidence.drives, evidence.whiteners, strict=True):
        times = probe_times(drive)
        pushed = np.zeros((times.size, 4, count))
        pushed[:, row] = hats(times, drive.start, drive.end, count)
        frame = whitener.frame
        out = np.empty((frame.times.size, count))
        respond(pushed, times, frame.times, drive.channels, frame.order, frame.cosine,
                frame.sine, whitener.model, setting('longest_step'), out)
        columns[top:top + len(out), first:first + count] = whitener.apply(out)
        first, top = first + count, top + len(out)
    return columns


def mismatches(evidence: Evidence, fit: Fit, subsystem: str | None) -> tuple[Mismatch, ...]:
    """
    Return the stretches in which the innovations of a fit are beyond their noise.

    Parameters
    ----------
    evidence : Evidence
        Its noise is that of the best model.
    fit : Fit
        Of the model in doubt.
    subsystem : str, optional
        Culprit, if it is known; else the part that the channel belongs to.

    Returns
    -------
    tuple of Mismatch
        Strongest first.

    """
    found: list[Mismatch] = []
    width, strong, join = (setting(n) for n in (
        'mismatch_window', 'mismatch_strength', 'mismatch_join'))
    place = 0
    for whitener in evidence.whiteners:
        frame = whitener.frame
        e = fit.whitened[place:place + frame.times.size]
        place += frame.times.size
        times, channels = frame.times[frame.order], frame.drive.channels[frame.order]
        for channel, (name, part) in NAMES.items():
            own = channels == int(channel)
            if np.count_nonzero(own) < 8:
                continue
            t, values = times[own], e[own]
            total = np.concatenate([[0.0], np.cumsum(values)])
            first = np.searchsorted(t, t - 0.5 * width, side='left')
            last = np.searchsorted(t, t + 0.5 * width, side='right')
            score = np.abs(total[last] - total[first]) / np.sqrt(last - first)
            for begin, end in _stretches(t, score > strong, join):
                inside = (t >= begin) & (t <= end)
                found.append(Mismatch(
                    frame.drive.recording, name, round(float(begin), 3), round(float(end), 3),
                    round(float(np.max(score[inside])), 2), subsystem or part))
    found.sort(key=lambda m: -m.strength * (m.end - m.start + width))
    return tuple(found[:int(setting('mismatches'))])


def _stretches(times: FloatArray, on: np.typing.NDArray[np.bool_], join: float
               ) -> list[tuple[float, float]]:
    stretches: list[tuple[float, float]] = []
    for moment in times[on].tolist():
        if stretches and moment - stretches[-1][1] <= join:
            stretches[-1] = (stretches[-1][0], moment)
        else:
            stretches.append((moment, moment))
    return stretches


def _regimes(drive: Drive, times: FloatArray) -> dict[str, np.typing.NDArray[np.bool_]]:
    # By the commands; a reading can be in several regimes.
    series = drive.commands
    forward_all, yaw_all = series.column('forward'), series.column('yaw')
    at = np.maximum(np.searchsorted(series.times, times, side='right') - 1, 0)
    span = setting('changing_span')
    before = np.maximum(np.searchsorted(series.times, times - span, side='right') - 1, 0)
    forward, yaw = forward_all[at], yaw_all[at]
    change = (np.abs(forward - forward_all[before])
              + setting('changing_lever') * np.abs(yaw - yaw_all[before])) / span
    still, turning = setting('still_speed'), np.abs(yaw) > setting('turning_rate')
    moving = (np.abs(forward) > still) | (np.abs(yaw) > still)
    changing = change > setting('changing_speed')
    return {
        'rest': ~moving & ~changing, 'accelerating': changing,
        'straight': moving & ~turning & ~changing,
        'spin': turning & (np.abs(forward) <= still) & ~changing,
        'steady_turn': turning & (np.abs(forward) > still) & ~changing,
        'reversing': forward < -still,
        'slow': moving & (np.abs(forward) < setting('slow_speed')) & ~changing & ~turning}


def where_it_shows(evidence: Evidence, gain: FloatArray) -> str:
    """
    Say in words where a gain comes from.

    Parameters
    ----------
    evidence : Evidence
        Its drives say when each innovation was, in the same order.
    gain : numpy.ndarray, shape (n,)
        Of each innovation [nats].

    Returns
    -------
    str
        The regimes with the densest gain, densest first.

    """
    total = float(np.sum(gain))
    if total <= 0.0:
        return 'everywhere'
    sums, counts, place = dict.fromkeys(WORDS, 0.0), dict.fromkeys(WORDS, 0), 0
    for whitener in evidence.whiteners:
        frame = whitener.frame
        own = gain[place:place + frame.times.size]
        place += frame.times.size
        for name, mask in _regimes(frame.drive, frame.times[frame.order]).items():
            sums[name] += float(np.sum(own[mask]))
            counts[name] += int(np.count_nonzero(mask))
    mean = total / gain.size
    rows = sorted(((sums[n] / counts[n], WORDS[n]) for n in WORDS
                   if counts[n] > setting('regime_readings')
                   and sums[n] > setting('regime_share') * total
                   and sums[n] / counts[n] > setting('regime_denser') * mean), reverse=True)
    return ' and '.join(word for _, word in rows[:2]) or 'everywhere'


def strengths(efforts: Sequence[Missing]) -> dict[str, float]:
    """Return the evidence of each balance, relative to the best one."""
    best = max((e.evidence for e in efforts), default=0.0)
    return {e.balance: max(e.evidence, 0.0) / max(best, 1e-9) for e in efforts}
