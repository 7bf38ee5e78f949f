# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects that begin at a time or a place: where, by the likelihood on either side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from lg_husky_sim.diagnosis.evidence.drives import Channel, Drive
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.evidence.frames import Frame
from lg_husky_sim.diagnosis.evidence.observation import Motion, observe, probe_times
from lg_husky_sim.diagnosis.evidence.whitener import STATES
from lg_husky_sim.diagnosis.hypotheses.hypothesis import Hypothesis, Numbers
from lg_husky_sim.diagnosis.selection.screening import (
    begin,
    gain_of,
    limits_of,
    Look,
    problems_of,
    Products,
    Projection,
)
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.husky.effects import Onset, OnsetKind
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray


def onsets_of(evidence: Evidence, finer: float = 1.0) -> list[Onset]:
    """
    Return where an effect may begin, on a grid of times and places.

    A recording is driven on after each of its segments but the last, and all but the first one
    follow others: there is no edge there.

    Parameters
    ----------
    evidence : Evidence
        Its drives say when and where the robot was.
    finer : float
        How often the spacing of this grid goes into that of the coarse one.

    Returns
    -------
    list of Onset

    """
    found = []
    spacing, edge = setting('onset_spacing') / finer, setting('onset_edge')
    whole: dict[str, tuple[float, float]] = {}
    for drive in evidence.drives:
        first, last = whole.get(drive.recording, (np.inf, -np.inf))
        whole[drive.recording] = min(first, drive.start), max(last, drive.end)
    for drive in evidence.drives:
        name, first, last = drive.recording, drive.start, drive.end
        if name == evidence.names[0] and first == whole[name][0]:
            first += edge
        if last == whole[name][1]:
            last -= edge
        found += [Onset(OnsetKind.TIME, float(t), name) for t in np.arange(first, last, spacing)]
    x = np.concatenate([d.measured[d.slice_of(Channel.X)] for d in evidence.drives])
    if x.size:
        low, high = np.quantile(x, [0.0, 1.0])
        count = int(np.clip((high - low) / setting('place_spacing'), 0, setting('most_places'))
                    * finer)
        for value in np.linspace(low, high, count + 2)[1:-1]:
            share = float(np.mean(x >= value))
            if min(share, 1.0 - share) > setting('least_share'):
                found += [Onset(OnsetKind.PLACE_ABOVE, float(value)),
                          Onset(OnsetKind.PLACE_BELOW, float(value))]
    return found


def onset_looks(evidence: Evidence, base: Fit, pool: Sequence[Hypothesis],
                seen: Sequence[Look]) -> list[Look]:
    """
    Look at every effect with an onset.

    One simulation of an effect that acts always serves for all onsets: see
    :func:`lg_husky_sim.diagnosis.evidence.whitener.whiten_switched`.

    Parameters
    ----------
    evidence : Evidence
        Drives, and the noise under which the base was fitted.
    base : Fit
        Fit without the effects that are looked at.
    pool : sequence of Hypothesis
        Effects to look at, each with every onset that the drives allow.
    seen : sequence of Look
        Without an onset, best first.

    Returns
    -------
    list of Look
        The best onset of each.

    """
    if base.point.structure.onset is not None:
        return []
    onsets = onsets_of(evidence)
    if not onsets:
        return []
    # What gains nothing where it acts always says nothing of its size elsewhere.
    known = {one.hypothesis.label: one.numbers for one in seen
             if one.gain >= setting('least_look')}
    switches = _Switches.of(evidence, base, onsets)

    def best_of(hypothesis: Hypothesis) -> Look | None:
        groups = hypothesis.trials()
        if hypothesis.label in known and len(groups) > 1:
            groups = [[{**groups[0][0], **known[hypothesis.label]}]]
        best: Look | None = None
        for group in groups:
            for onset, (gain, coefficients) in zip(onsets, switches.gains(hypothesis, group),
                                                   strict=False):
                if gain > (0.0 if best is None else best.gain):
                    at = hypothesis.at(onset)
                    best = Look(at, begin(at, group, coefficients), gain)
        return best
    open_ones = [h for h in pool if not h.effect.always_on and h.effect.shape != 'grip']
    return [one for one in evidence.pool.map(best_of, open_ones) if one is not None]


@dataclass(frozen=True, eq=False)
class _Switches:
    """What effects gain that begin at some onsets, by one simulation of each."""

    evidence: Evidence
    base: Fit
    projection: Projection
    motions: Sequence[Motion]
    patterns: Sequence[_Patterns]

    @classmethod
    def of(cls, evidence: Evidence, base: Fit, onsets: Sequence[Onset]) -> _Switches:
        motions = evidence.motions(base.point, True)
        return cls(evidence, base, Projection(base), motions, [
            _patterns(evidence, d, motion, w.frame.times[w.frame.order], onsets)
            for d, motion, w in zip(evidence.drives, motions, evidence.whiteners, strict=True)])

    def gains(self, hypothesis: Hypothesis, group: Sequence[Numbers]
              ) -> list[tuple[float, FloatArray]]:
        """Return the gain at each onset and the coefficients; nothing if it runs away."""
        changes = _changes(self.evidence, self.base, self.motions, hypothesis, group)
        if changes is None:
            return []
        limits = limits_of(hypothesis, group)
        problems = problems_of(_products(self.projection, self.evidence, changes, self.patterns))
        return [gain_of(normal, slope, limits) for normal, slope in zip(*problems, strict=True)]


@dataclass(frozen=True, eq=False)
class _Patterns:
    """
    When an effect acts in one drive.

    Parameters
    ----------
    different : numpy.ndarray of uint8, shape (n, k)
        Whether it acts at each reading, in the order of time.
    place : numpy.ndarray of int, shape (m,)
        Which of the k columns each onset has.

    """

    different: NDArray[np.uint8]
    place: NDArray[np.intp]


def _patterns(evidence: Evidence, drive: Drive, motion: Motion, times: FloatArray,
              onsets: Sequence[Onset]) -> _Patterns:
    # In another recording than its own, an onset is like any other there.
    names = list(evidence.names)
    at = names.index(drive.recording)
    place = (np.interp(times, drive.pose_times, drive.measured[drive.slice_of(Channel.X)])
             if drive.pose_times.size else
             np.interp(times, probe_times(drive), motion.column('x', 'probe')))
    found: NDArray[np.uint8] = np.zeros((len(onsets), times.size), dtype=np.uint8)
    for k, onset in enumerate(onsets):
        match onset.kind:
            case OnsetKind.TIME:
                own = names.index(onset.recording)
                found[k] = at > own if at != own else times >= onset.value
            case OnsetKind.PLACE_ABOVE:
                found[k] = place >= onset.value
            case OnsetKind.PLACE_BELOW:
                found[k] = place <= onset.value
    known: dict[bytes, int] = {}
    number = np.array([known.setdefault(row.tobytes(), len(known)) for row in found])
    _, first = np.unique(number, return_index=True)
    return _Patterns(np.ascontiguousarray(found[first].T), number)


def _changes(evidence: Evidence, base: Fit, motions: Sequence[Motion], hypothesis: Hypothesis,
             group: Sequence[Numbers]) -> list[list[tuple[FloatArray, FloatArray]]] | None:
    # Of each number and drive, the change of the readings and what has built up at each of them.
    found = []
    for numbers in group:
        try:
            point = hypothesis.at(None).point(base.point, numbers)
            moved = evidence.motions(point, True)
        except LgHuskyError:
            return None
        parts = []
        for drive, motion, before, whitener, old in zip(
                evidence.drives, moved, motions, evidence.whiteners, base.predicted, strict=True):
            change = observe(motion, drive, point.log) - old
            if not np.all(np.isfinite(change)):
                return None
            parts.append((change, _built_up(drive, motion, before, change, whitener.frame)))
        found.append(parts)
    return found


def _products(projection: Projection, evidence: Evidence,
              changes: Sequence[Sequence[tuple[FloatArray, FloatArray]]],
              patterns: Sequence[_Patterns]) -> Products:
    # Of the whitened changes, one set an onset.
    total: list[FloatArray] = []
    top = 0
    for number, (whitener, own) in enumerate(zip(evidence.whiteners, patterns, strict=True)):
        count, width = own.different.shape
        batch = max(1, int(setting('onset_batch')) // (count * len(changes)))
        parts = []
        for first in range(0, width, batch):
            on = np.ascontiguousarray(own.different[:, first:first + batch])
            columns = np.empty((count, len(changes), on.shape[1]))
            for i, of_number in enumerate(changes):
                columns[:, i] = whitener.switched(*of_number[number], on)
            parts.append(projection.products(columns, top))
        sums = [np.concatenate(some, axis=-1)[..., own.place]
                for some in zip(*parts, strict=True)]
        total = [a + b for a, b in zip(total, sums, strict=True)] if total else sums
        top += count
    return total[0], total[1], total[2]


def _built_up(drive: Drive, motion: Motion, before: Motion, change: FloatArray, frame: Frame
              ) -> FloatArray:
    # Deviation states at each reading: velocities, heading, place, angles.
    times = frame.times[frame.order]
    states = np.zeros((times.size, STATES))
    grid = probe_times(drive)
    for state, name in ((4, 'forward'), (5, 'yaw_rate'), (7, 'heading')):
        difference = motion.column(name, 'probe') - before.column(name, 'probe')
        states[:, state] = np.interp(times, grid, difference)
    for state, side, zero in zip((10, 11), ('left', 'right'), drive.wheel_angles, strict=True):
        # As encoders have counted them.
        now, then = (getattr(one.plant.sets[-1].sensors, f'encoder_{side}')
                     * (one.column(f'angle_{side}', 'probe') - zero) for one in (motion, before))
        states[:, state] = np.interp(times, grid, now - then)
    if drive.pose_times.size and np.any(states[:, 4]):
        for state, channel in ((8, Channel.X), (9, Channel.Y)):
            part = drive.slice_of(channel)
            states[:, state] = np.interp(times, drive.times[part], change[part])
    return states


def refined(evidence: Evidence, base: Fit, tried: Any, attempt: Callable[..., Any],
            numbers: Callable[..., Any]) -> Any:
    """
    Move an onset to where the cost is least.

    The cost may have several minima, and the one at the true onset is narrow: it is looked for on
    a grid as fine as onsets are told apart, too.

    Parameters
    ----------
    evidence : Evidence
        Drives, and the noise under which the fits were made.
    base : Fit
        Fit without the effect.
    tried : Tried
        With an onset of the coarse grid.
    attempt, numbers : callable
        Fit a hypothesis; numbers of a fitted one.

    Returns
    -------
    Tried

    """
    def fitted(near: Any, onset: Onset) -> Any:
        own = near.fit.point.places[:base.point.places.size]
        return attempt(evidence, base, near.hypothesis.at(onset), [
            (base.point, numbers(near)), (base.point.at(own), numbers(near))])

    def moved(near: Any) -> Any:
        onset = _least(evidence, base, near, numbers(near))
        again = None if onset == near.hypothesis.onset else fitted(near, onset)
        return again if again is not None and again.gain > near.gain else near
    found = [tried, *(fitted(tried, onset) for onset in _others(
        evidence, base, tried.hypothesis, numbers(tried)))]
    return max((moved(one) for one in found if one is not None), key=lambda one: one.gain)


def _others(evidence: Evidence, base: Fit, hypothesis: Hypothesis, numbers: Numbers
            ) -> list[Onset]:
    # Onsets of a fine grid that promise more than the present one, best first.
    now, apart = hypothesis.onset, setting('onset_spacing')
    assert now is not None
    grid = [now, *(one for one in onsets_of(evidence, apart / setting('onset_resolution'))
                   if one.kind is now.kind)]
    promised = [gain for gain, _ in _Switches.of(evidence, base, grid).gains(
        hypothesis.at(None), [numbers])]
    found: list[Onset] = []
    near = setting('onset_resolution') if now.kind is OnsetKind.TIME else (
        setting('place_spacing') * setting('onset_resolution') / apart)
    for gain, one in sorted(zip(promised, grid, strict=False), key=lambda two: -two[0]):
        if gain <= promised[0] + setting('least_look') or (
                len(found) == int(setting('onset_starts'))):
            break
        if all(one.recording != other.recording or abs(one.value - other.value) > 2.0 * near
               for other in (now, *found)):
            found.append(one)
    return found


def _least(evidence: Evidence, base: Fit, tried: Any, numbers: Numbers) -> Onset:
    # Where the cost of a fit is least as its onset alone moves, in steps that get shorter.
    onset: Onset = tried.hypothesis.onset
    is_time = onset.kind is OnsetKind.TIME
    step = 0.5 * (setting('onset_spacing') if is_time else setting('place_spacing'))
    least = setting('onset_time_step') if is_time else setting('onset_place_step')
    point, best = tried.fit.point, tried.fit.cost
    value = onset.value
    limits = [(d.start, d.end) for d in evidence.drives if d.recording == onset.recording]

    def cost(at: float) -> float:
        if is_time and limits and not limits[0][0] <= at <= limits[-1][1]:
            return np.inf
        moved = tried.hypothesis.at(Onset(onset.kind, at, onset.recording))
        there = moved.point(base.point, numbers).at(point.places)
        return evidence.cost(evidence.residuals(evidence.predict(there)), there)
    while step > least:
        options = [(cost(value + s * step), value + s * step) for s in (-1.0, 1.0)]
        found, place = min(options)
        if found < best:
            best, value = found, place
        else:
            step *= 0.5
    return Onset(onset.kind, value, onset.recording)
