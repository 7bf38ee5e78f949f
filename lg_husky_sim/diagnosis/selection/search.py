# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Forward steps with noise that is estimated again, then backward elimination."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
import math

from lg_husky_sim.diagnosis.evidence.base_clock import ticking
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.evidence.point import Point
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import loosened, start_of
from lg_husky_sim.diagnosis.hypotheses.hypothesis import (
    having,
    hypotheses,
    Hypothesis,
    Numbers,
    with_effects,
)
from lg_husky_sim.diagnosis.selection.conventions import (
    best_reading,
    gyro_reading,
    wheel_reading,
)
from lg_husky_sim.diagnosis.selection.elimination import eliminated
from lg_husky_sim.diagnosis.selection.exchange import exchanged
from lg_husky_sim.diagnosis.selection.laws import Laws
from lg_husky_sim.diagnosis.selection.narrowing import narrowed
from lg_husky_sim.diagnosis.selection.nominal import is_distorted, nominal_of
from lg_husky_sim.diagnosis.selection.recalibration import (
    as_logged,
    at_ticks,
    Logged,
    promised,
    promising,
    recalibrated,
)
from lg_husky_sim.diagnosis.selection.rotors import other_rotors
from lg_husky_sim.diagnosis.selection.rounds import calibrated, forward_step, Round, with_jitter
from lg_husky_sim.diagnosis.selection.tried import numbers_of, Tried
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.signals import FloatArray
import numpy as np

Progress = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class Search:
    """
    What a search found.

    Parameters
    ----------
    plain : Fit
        The recalibrated model without effects, under the last noise.
    final : Fit
    evidence : Evidence
        With the last noise.
    rounds : tuple of Round
    found : tuple of Hypothesis
        Adopted, in the order of adoption.
    beside : Fit or None
        Where nothing is adopted: with what is beyond chance and too little to be likely real.

    """

    plain: Fit
    final: Fit
    evidence: Evidence
    rounds: tuple[Round, ...]
    found: tuple[Hypothesis, ...]
    beside: Fit | None = None

    @property
    def adopted(self) -> tuple[Round, ...]:
        """Return the rounds whose best hypothesis was adopted."""
        return self.rounds[:len(self.found)]


def _read_as(evidence: Evidence, base: Fit, chosen: Fit) -> tuple[Evidence, Fit]:
    if chosen is base:
        return evidence, base
    evidence = evidence.renoised(chosen)
    return evidence, evidence.fit(with_jitter(chosen.point, evidence))


def seeds_of(first: Evidence, rough: Fit, base: Fit, logged: Logged) -> list[Tried]:
    """
    Return what to begin with where recalibrated numbers or noise may hide an effect.

    Parameters
    ----------
    first : Evidence
        Under a first guess of the noise.
    rough : Fit
        Of the nominal model under it, after one step.
    base : Fit
        Recalibrated.
    logged : Logged
        Effects that were fitted there: those that promised more than another reading of the
        sensors, or all, each with a reading of its own. Beside these, unless one promised more,
        those that promise most at the nominal numbers are looked for.

    Returns
    -------
    list of Tried
        The effect that gains most from there, with numbers, noise and reading of its own; none
        where none promised more than a reading and the recalibration has a small prior penalty.

    """
    names = [u.name for u in base.point.unknowns]
    found = []
    if logged.better and names == [u.name for u in rough.point.unknowns]:
        best = logged.better[0]
        found.append(_best_start(first, rough, [(
            best.hypothesis, best.fit.point.places[:len(names)], numbers_of(best))]))
    elif is_distorted(base):
        found.append(read_anew(first, base, logged.early))
        nominal = nominal_of(base.point)
        first = first.about(nominal)
        rough = first.fit(nominal, rounds=1)
        pool = [h for h in hypotheses(base.point.structure) if not h.effect.kind.needs_onset]
        found.append(_best_start(first, rough, [
            (one.hypothesis, rough.point.places, one.numbers)
            for one in promising(first, rough, pool)]))
    seeds = [_own(*one, base) for one in found if one is not None]
    return [max(seeds, key=lambda one: one.score)] if seeds else []


def _best_start(evidence: Evidence, base: Fit, begins: Sequence[tuple[
        Hypothesis, FloatArray, Numbers]]) -> tuple[Evidence, Hypothesis, Point] | None:
    # The likeliest of some effects, each from all its starts. Where they begin the model is off by
    # many deviations, which have no weight then: first under noise as large as what is left.
    starts = []
    for hypothesis, places, numbers in begins:
        there = base.point.at(places)
        more = narrowed(evidence, hypothesis, there)
        starts += [(hypothesis, hypothesis.point(there, one)) for one in (
            numbers, *hypothesis.starts, *([] if more is None else [more]))]
    left = evidence.residuals(evidence.predict(base.point.at(begins[0][1]))) if begins else 0.0
    inflation = max(1.0, float(np.sqrt(np.mean(np.square(left)))))

    def fitted_from(start: tuple[Hypothesis, Point], rounds: int, wider: float,
                    slopes: bool = False) -> Fit | None:
        own = range(len(base.point.unknowns), len(start[1].unknowns))
        known = [np.hstack([one, np.zeros((one.shape[0], len(own)))])
                 for one in base.slopes] if slopes else None
        try:
            return evidence.fit(start[1], known, rounds=rounds, renew=own if slopes else None,
                                inflation=wider)
        except LgHuskyError:
            # It runs away from there.
            return None

    def goes_on(start: tuple[Hypothesis, Point]) -> Fit | None:
        rough = fitted_from(start, few, inflation)
        return rough and fitted_from((start[0], rough.point), int(setting('seed_rounds')), 1.0)
    few = int(setting('seed_start'))
    begun = evidence.pool.map(lambda start: fitted_from(start, few, inflation, True), starts)
    ahead = sorted(((start[0], fit) for start, fit in zip(starts, begun, strict=True) if fit),
                   key=lambda one: one[1].cost)[:int(setting('seeds_finished'))]
    ends = evidence.pool.map(goes_on, [(one, fit.point) for one, fit in ahead])
    done = [Tried(one, fit, base.cost - fit.cost, evidence.count)
            for (one, _), fit in zip(ahead, ends, strict=True) if fit]
    if not done:
        return None
    best = max(done, key=lambda one: one.score)
    return evidence, best.hypothesis, best.fit.point


def read_anew(evidence: Evidence, base: Fit, early: Sequence[Tried]
              ) -> tuple[Evidence, Hypothesis, Point] | None:
    """
    Return the likeliest of some effects if each has a reading of its own.

    Parameters
    ----------
    evidence : Evidence
        Drives, and the noise under which the effects were fitted.
    base : Fit
        Without effects.
    early : sequence of Tried
        Effects with their fits, any number.

    Returns
    -------
    tuple of (Evidence, Hypothesis, Point) or None
        None where there are no effects.

    """
    read = [(wheel_reading(evidence, one.fit), one.hypothesis) for one in early]
    if not read:
        return None
    fit, hypothesis = min(read, key=lambda one: one[0].cost)
    # Gyros are followed far less far by what they smooth.
    fit = gyro_reading(evidence, fit)
    return evidence, hypothesis, with_effects(base.point, fit.point, [hypothesis])


def _own(evidence: Evidence, hypothesis: Hypothesis, point: Point, base: Fit) -> Tried:
    # Under noise of its own.
    own, fit = calibrated(evidence, point, 1)
    return Tried(hypothesis, fit, own.fit(base.point).cost - fit.cost, own.count)


def _read_like(evidence: Evidence, base: Fit, seed: Tried) -> tuple[Fit, Tried]:
    # The base, and the seed's gain over it, if the log was made as the seed says.
    plain = evidence.fit(with_effects(base.point, seed.fit.point, []))
    fit = evidence.fit(seed.fit.point)
    return plain, Tried(seed.hypothesis, fit, plain.cost - fit.cost, evidence.count)


def _settled(evidence: Evidence, point: Point, first: Evidence) -> tuple[Evidence, Fit]:
    # The likeliest numbers and noise of an adopted structure: where they began far from the robot
    # as it should be, since the base had absorbed the effect, from there, too, and from there
    # with a log that was made as most are, under a first guess of the noise.
    best = calibrated(evidence, point, 1)
    if is_distorted(best[1]):
        start = nominal_of(best[1].point)
        # With an effect that only other numbers can bear it runs away there.
        with suppress(LgHuskyError):
            best = _likelier(best, calibrated(evidence.about(start), start))
            start = as_usual(start)
            own, fit = calibrated(first.about(start), start)
            best = _likelier(best, _read_as(own, fit, best_reading(own, fit)))
    return best


def _likelier(one: tuple[Evidence, Fit], other: tuple[Evidence, Fit]) -> tuple[Evidence, Fit]:
    return min(one, other, key=lambda each: each[0].surprise(each[1]))


def as_usual(point: Point) -> Point:
    """Return a point with its effects and the robot's numbers, of a log made as most are."""
    kept = [place for place, u in enumerate(point.unknowns) if u.name not in (
        'imu_window', 'wheel_mean', 'wheel_smoothing')]
    unknowns = tuple(point.unknowns[place] for place in kept)
    unknowns = loosened(unknowns, {u.name: 0.0 for u in unknowns if u.room})
    centres = start_of(unknowns)
    places = np.array([centres[to] if u.kind == 'log' else point.places[place]
                       for to, (place, u) in enumerate(zip(kept, unknowns, strict=True))])
    return replace(point, reading=Reading(), unknowns=unknowns, places=places)


def _without_the_dropped(rounds: Sequence[Round], found: Sequence[Hypothesis],
                         kept: Sequence[Hypothesis]) -> list[Round]:
    # There is always one that says what was looked at last, adopted or not.
    left = [r for r, h in zip(rounds, found, strict=False) if h in kept]
    return [*left, *rounds[len(found):]] or [replace(rounds[-1], adopted=False)]


def search(evidence: Evidence, start: Point, progress: Progress) -> Search:
    """
    Find what a model lacks.

    Parameters
    ----------
    evidence : Evidence
        Under a first guess of the noise.
    start : Point
        The nominal model.
    progress : callable
        Told what is being done and how far it is (0 to 1).

    Returns
    -------
    Search

    """
    progress('recalibration', 0.05)
    known = recalibrated(evidence, start)
    rivals = ticking(known.evidence, known.base)
    if rivals:
        progress('update rate of the base', 0.08)
        other = at_ticks(known, start, rivals)
        if other is not None:
            known, rivals = other, []
    evidence, base, initial = known.evidence, known.base, start
    seeds = seeds_of(known.first, known.rough, base, known.logged)
    # Nothing goes on from what was fitted on the way there.
    known = replace(known, rough=base.bare, base=base.bare, logged=Logged(base.bare))
    otherwise = None
    if seeds and seeds[0].fit.point.reading != base.point.reading:
        # Counted against the base with its own reading.
        if seeds[0].score > 0.0:
            otherwise = evidence, base
            base, seeds[0] = _read_like(evidence, base, seeds[0])
        else:
            seeds = []
    logged = Logged(base, seeds) if otherwise else as_logged(evidence, base)
    if seeds and seeds[0].gain > promised(base, logged.fit):
        logged = Logged(base, seeds)
    postponed = bool(logged.better)
    evidence, base = _read_as(evidence, base, logged.fit)
    usual = Reading()
    start = nominal_of(base.point)
    plain = base
    rounds: list[Round] = []
    found: list[Hypothesis] = []
    ticks = False
    while len(rounds) < int(setting('most_effects')):
        number = len(rounds)
        progress(f'looking for effect {number + 1}', 0.1 + 0.25 * number)
        one = forward_step(evidence, base, hypotheses(base.point.structure),
                           None if found else start,
                           Laws(plain.point, found) if found else None, seeds)
        seeds = []
        best = one.tried[0] if one.tried else None
        evidence, base = one.evidence, one.base
        adopted = best is not None and one.adopted
        other_base = other_rotors(evidence, base)
        if other_base is not None and (
                not adopted or best is None or best.score <= base.cost - other_base.cost
                - 0.5 * math.log(evidence.count)):
            # No effect, but a robot that the nominal numbers leave something out of: look again.
            otherwise, postponed = None, False
            evidence, base = calibrated(evidence, other_base.point, 1)
            evidence, base = _read_as(evidence, base, best_reading(evidence, base, afresh=True))
            known = replace(known, evidence=evidence, base=base.bare)
            start = nominal_of(base.point)
            plain = evidence.fit(with_effects(plain.point, base.point, []))
            continue
        if postponed and not found:
            chosen = best_reading(evidence, base)
            if not adopted or best is None or base.cost - chosen.cost >= best.gain:
                # The log was made otherwise, or else nothing says so: look again.
                postponed = False
                if otherwise is not None:
                    evidence, base = otherwise
                    chosen, otherwise = best_reading(evidence, base), None
                evidence, base = _read_as(evidence, base, chosen)
                start = nominal_of(base.point)
                continue
        one = replace(one, base=base.bare)
        rounds.append(one)
        if number == 0:
            plain = base if otherwise is None else evidence.fit(otherwise[1].point)
        if not adopted or best is None:
            break
        found.append(best.hypothesis)
        evidence, base = _settled(evidence, best.fit.point, known.first)
        # What was found may have distorted the robot with and without ticks: they are tried again.
        other = at_ticks(replace(known, evidence=evidence, base=base), having(
            initial, base.point, found), rivals) if rivals else None
        if other is not None:
            known, rivals, ticks = other, [], True
            evidence, base, postponed = other.evidence, other.base, True
            plain = evidence.fit(with_effects(plain.point, base.point, []))
        if postponed or base.point.reading != usual:
            evidence, base = _read_as(evidence, base, best_reading(evidence, base))
            postponed = False
    if len(found) > 1 or ticks or base.point.delays or (
            found and base.point.reading != rounds[0].base.point.reading):
        base, rounds, found = exchanged(evidence, plain.point, base, rounds, found)
        base, kept = eliminated(evidence, plain.point, base, found)
        rounds = _without_the_dropped(rounds, found, kept)
        found = kept
    # Its innovations are told apart by the frames of the last evidence.
    plain = evidence.fit(plain.point, plain.slopes) if found else base
    last = rounds[-1]
    beside = evidence.fit(last.tried[0].fit.point) if last.small and not found else None
    return Search(plain, base, evidence, tuple(rounds), tuple(found), beside)
