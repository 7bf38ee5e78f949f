# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Forward steps with noise that is estimated again, then backward elimination."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from lg_husky_sim.diagnosis.evidence.base_clock import ticking
from lg_husky_sim.diagnosis.evidence.drives import Drive
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, evidence_of, Fit
from lg_husky_sim.diagnosis.evidence.point import Point
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.stamps import likeliest_stamps
from lg_husky_sim.diagnosis.evidence.unknowns import loosened, start_of, tick_unknowns
from lg_husky_sim.diagnosis.hypotheses.hypothesis import (
    hypotheses,
    Hypothesis,
    Numbers,
    with_effects,
)
from lg_husky_sim.diagnosis.selection.conventions import best_reading
from lg_husky_sim.diagnosis.selection.elimination import eliminated
from lg_husky_sim.diagnosis.selection.laws import Laws
from lg_husky_sim.diagnosis.selection.nominal import is_distorted, nominal_of
from lg_husky_sim.diagnosis.selection.rounds import (
    attempt,
    calibrated,
    fitted,
    forward_step,
    numbers_of,
    Round,
    Tried,
    with_jitter,
)
from lg_husky_sim.diagnosis.selection.screening import Look, look
from lg_husky_sim.diagnosis.selection.ticks import ticks_are_likelier
from lg_husky_sim.diagnosis.settings import setting
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
    """

    plain: Fit
    final: Fit
    evidence: Evidence
    rounds: tuple[Round, ...]
    found: tuple[Hypothesis, ...]

    @property
    def adopted(self) -> tuple[Round, ...]:
        """The rounds whose best hypothesis was adopted."""
        return self.rounds[:len(self.found)]


@dataclass(frozen=True, eq=False)
class Logged:
    """
    A reading of the sensors, or effects that pass for one.

    Parameters
    ----------
    fit : Fit
        Of the base: with the likeliest reading, or with the usual one where an effect promises
        more than the reading gains and the reading waits for what the effect really gains.
    better : sequence of Tried
        The effects that promise more, best first.
    early : sequence of Tried
        All that were fitted under the usual reading, best first.
    """

    fit: Fit
    better: Sequence[Tried] = ()
    early: Sequence[Tried] = ()


def _as_logged(evidence: Evidence, base: Fit, afresh: bool = False) -> Logged:
    chosen = best_reading(evidence, base, afresh)
    if chosen is base:
        return Logged(base)
    pool = [h for h in hypotheses(base.point.structure) if not h.effect.kind.needs_onset]
    early = fitted(evidence, base, _promising(evidence, base, pool), [base.point], whole=False)
    better = [t for t in early if t.gain > _promised(base, chosen)]
    return Logged(base if better else chosen, better, early)


def _promising(evidence: Evidence, base: Fit, pool: Sequence[Hypothesis]) -> list[Look]:
    # The looks at the effects that promise most, each in its best form.
    best: dict[str, Look] = {}
    for one in look(evidence, base, pool):
        best.setdefault(one.hypothesis.effect.id, one)
    return list(best.values())[:int(setting('early_effects'))]


def _promised(base: Fit, chosen: Fit) -> float:
    # What an effect has to gain for another reading to wait.
    return (1.0 + setting('near_margin')) * (base.cost - chosen.cost)


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
            for one in _promising(first, rough, pool)]))
    seeds = [_own(*one, base) for one in found if one is not None]
    return [max(seeds, key=lambda one: one.score)] if seeds else []


def _best_start(evidence: Evidence, base: Fit, begins: Sequence[tuple[
        Hypothesis, FloatArray, Numbers]]) -> tuple[Evidence, Hypothesis, Point] | None:
    def fitted_from(begin: tuple[Hypothesis, FloatArray, Numbers]) -> Tried | None:
        hypothesis, places, numbers = begin
        there = base.point.at(places)
        return attempt(evidence, base, hypothesis, [
            (there, start) for start in (numbers, *hypothesis.starts)], whole=False)
    fits = evidence.pool.map(fitted_from, begins)
    tried = [one for one in fits if one is not None]
    if not tried:
        return None
    best = max(tried, key=lambda one: one.score)
    return evidence, best.hypothesis, best.fit.point


def read_anew(evidence: Evidence, base: Fit, early: Sequence[Tried]
              ) -> tuple[Evidence, Hypothesis, Point] | None:
    """
    Return the likeliest of some effects if each has a reading of its own.

    Parameters
    ----------
    evidence : Evidence
    base : Fit
        Without effects.
    early : sequence of Tried

    Returns
    -------
    tuple of (Evidence, Hypothesis, Point) or None
        None where there are no effects.
    """
    read = [(best_reading(evidence, one.fit), one.hypothesis) for one in early]
    if not read:
        return None
    fit, hypothesis = min(read, key=lambda one: one[0].cost)
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


@dataclass(frozen=True, eq=False)
class Recalibrated:
    """
    The model as it is, with the noise and the reading of the log.

    Parameters
    ----------
    first : Evidence
        Under a first guess of the noise.
    rough : Fit
        Under it, after one step.
    logged : Logged
    evidence : Evidence
        With the last noise.
    base : Fit
        Under that.
    """

    first: Evidence
    rough: Fit
    logged: Logged
    evidence: Evidence
    base: Fit


def recalibrated(evidence: Evidence, start: Point) -> Recalibrated:
    """Fit the model as it is, from where it should be."""
    # Under a wrong reading the numbers of the robot would take its place: first of all at nominal.
    rough = evidence.fit(start, rounds=1)
    stamped, point = likeliest_stamps(evidence, rough)
    if stamped is not evidence:
        evidence, rough = stamped, stamped.fit(point, rounds=1)
    logged = _as_logged(evidence, rough, afresh=True)
    start = nominal_of(logged.fit.point)
    return Recalibrated(evidence, rough, logged, *calibrated(evidence.about(start), start))


def at_ticks(known: Recalibrated, start: Point, progress: Progress) -> Recalibrated | None:
    """Return the same of a base that applies commands at its own ticks, if that is likelier."""
    rivals = ticking(known.evidence, known.base)
    if not rivals:
        return None
    progress('update rate of the base', 0.08)

    def ticked(evidence: Evidence, point: Point,
               drives: Sequence[Drive]) -> tuple[Evidence, Point]:
        own = tick_unknowns(drives)
        wider = replace(point, unknowns=(*point.unknowns, *own),
                        places=np.append(point.places, start_of(own)))
        return evidence_of(drives, evidence.names, wider, evidence.noise, evidence.pool), wider
    # From where delays have not taken their place.
    afresh = [(evidence, evidence.fit(point)) for evidence, point in (
        ticked(known.first, start, drives) for drives in rivals)]
    best = min(range(len(afresh)), key=lambda k: afresh[k][1].cost)
    evidence, drives = afresh[best][0], rivals[best]
    near = calibrated(evidence, afresh[best][1].point, 1)
    if not ticks_are_likelier((known.evidence, known.base), near, drives):
        return None
    other = recalibrated(*ticked(known.first, start, drives))
    # What is distorted with them, too, lacks something else, which they may be a part of.
    return None if is_distorted(other.base) else other


def _settled(evidence: Evidence, point: Point, first: Evidence) -> tuple[Evidence, Fit]:
    # The likeliest numbers and noise of an adopted structure: where they began far from the robot
    # as it should be, since the base had absorbed the effect, from there, too, and from there
    # with a log that was made as most are, under a first guess of the noise.
    found = [calibrated(evidence, point, 1)]
    if is_distorted(found[0][1]):
        start = nominal_of(found[0][1].point)
        found.append(calibrated(evidence.about(start), start))
        start = as_usual(start)
        own, fit = calibrated(first.about(start), start)
        found.append(_read_as(own, fit, best_reading(own, fit)))
    return min(found, key=lambda one: one[0].surprise(one[1]))


def as_usual(point: Point) -> Point:
    """Return a point with its effects and the robot's numbers, of a log made as most are."""
    kept = [place for place, u in enumerate(point.unknowns) if u.name != 'imu_window']
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
    ticked = at_ticks(known, start, progress)
    if ticked is not None:
        known = ticked
    evidence, base = known.evidence, known.base
    seeds = seeds_of(known.first, known.rough, base, known.logged)
    otherwise = None
    if seeds and seeds[0].fit.point.reading != base.point.reading:
        # Counted against the base with its own reading.
        if seeds[0].score > 0.0:
            otherwise = evidence, base
            base, seeds[0] = _read_like(evidence, base, seeds[0])
        else:
            seeds = []
    logged = Logged(base, seeds) if otherwise else _as_logged(evidence, base)
    if seeds and seeds[0].gain > _promised(base, logged.fit):
        logged = Logged(base, seeds)
    postponed = bool(logged.better)
    evidence, base = _read_as(evidence, base, logged.fit)
    usual = Reading()
    start = nominal_of(base.point)
    plain = base
    rounds: list[Round] = []
    found: list[Hypothesis] = []
    while len(rounds) < int(setting('most_effects')):
        number = len(rounds)
        progress(f'looking for effect {number + 1}', 0.1 + 0.25 * number)
        one = forward_step(evidence, base, hypotheses(base.point.structure),
                           None if found else start,
                           Laws(plain.point, found) if found else None, seeds)
        seeds = []
        best = one.tried[0] if one.tried else None
        evidence = one.evidence
        adopted = best is not None and one.adopted
        if postponed and not found:
            chosen = best_reading(evidence, one.base)
            if not adopted or best is None or one.base.cost - chosen.cost >= best.gain:
                # The log was made otherwise, or else nothing says so: look again.
                postponed = False
                base = one.base
                if otherwise is not None:
                    evidence, base = otherwise
                    chosen, otherwise = best_reading(evidence, base), None
                evidence, base = _read_as(evidence, base, chosen)
                start = nominal_of(base.point)
                continue
        rounds.append(one)
        if number == 0:
            plain = one.base if otherwise is None else one.evidence.fit(otherwise[1].point)
        if not adopted or best is None:
            base = one.base
            break
        found.append(best.hypothesis)
        evidence, base = _settled(evidence, best.fit.point, known.first)
        if postponed or base.point.reading != usual:
            evidence, base = _read_as(evidence, base, best_reading(evidence, base))
            postponed = False
    if len(found) > 1 or base.point.delays or (
            found and base.point.reading != rounds[0].base.point.reading):
        base, kept = eliminated(evidence, plain.point, base, found)
        rounds = _without_the_dropped(rounds, found, kept)
        found = kept
        plain = plain if found else base
    return Search(plain, base, evidence, tuple(rounds), tuple(found))
