# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
One round of a search: look at every hypothesis, fit the most promising, compare them.

The noise is taken anew at the best, and all are compared under that one noise: gains are
comparable only under one whitener.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
import itertools
import math

from lg_husky_sim.diagnosis.decision.adoption import is_beyond_chance, is_rather_real
from lg_husky_sim.diagnosis.decision.strain import relieves
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.evidence.point import Point
from lg_husky_sim.diagnosis.evidence.unknowns import loosened
from lg_husky_sim.diagnosis.hypotheses.hypothesis import Hypothesis, Numbers
from lg_husky_sim.diagnosis.selection.laws import Laws
from lg_husky_sim.diagnosis.selection.narrowing import narrowed
from lg_husky_sim.diagnosis.selection.nominal import is_distorted
from lg_husky_sim.diagnosis.selection.onsets import onset_looks, refined
from lg_husky_sim.diagnosis.selection.screening import Look, look
from lg_husky_sim.diagnosis.selection.ties import is_near
from lg_husky_sim.diagnosis.selection.tried import numbers_of, Ranking, Tried
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.husky.effects import Effect
import numpy as np


@dataclass(frozen=True, eq=False)
class Round:
    """
    One round of the search.

    Parameters
    ----------
    evidence : Evidence
        With the noise at the best hypothesis.
    base : Fit
        Without a further effect, under that noise.
    tried : tuple of Tried
        Best score first.
    adopted : bool
    chance : float
        Probability of such a gain on a robot that lacks nothing.
    looks : tuple of Look
    small : bool
        Whether the best is beyond chance, but too little to be likely real, and no relief.

    """

    evidence: Evidence
    base: Fit
    tried: tuple[Tried, ...]
    adopted: bool
    chance: float
    looks: tuple[Look, ...] = field(default=())
    small: bool = False


def calibrated(evidence: Evidence, start: Point, times: int = 2) -> tuple[Evidence, Fit]:
    """
    Fit a structure and the noise, in turns.

    Parameters
    ----------
    evidence : Evidence
        With the noise to begin with.
    start : Point
        Where the first fit begins.
    times : int
        Turns.

    Returns
    -------
    Evidence
        With the noise of the fit.
    Fit
        Under that noise.

    """
    fit = evidence.fit(start)
    for _ in range(times):
        evidence = evidence.renoised(fit)
        fit = evidence.fit(with_jitter(fit.point, evidence), fit.slopes)
    return evidence, fit


def with_jitter(point: Point, evidence: Evidence) -> Point:
    """
    Return a point whose delays are as large as the jitter of the stamps suggests.

    A delay that an effect of the point is there for is all of the effect: it is not to be shared
    with how the log was made.
    """
    of = {'command_delay': 'command_jitter', 'delay_wheels': 'wheel_jitter',
          'delay_imu': 'imu_jitter', 'delay_pose': 'pose_jitter'}
    noise, told = evidence.noise.values, set(point.delays.values())
    unknowns = loosened(point.unknowns, {
        name: 0.0 if name in told else noise[jitter] for name, jitter in of.items()})
    return replace(point, unknowns=unknowns).at(point.places)


def attempt(evidence: Evidence, base: Fit, hypothesis: Hypothesis, begins: Sequence[
        tuple[Point, Numbers]], whole: bool = True) -> Tried | None:
    """
    Fit a hypothesis from several beginnings.

    Parameters
    ----------
    evidence : Evidence
        Drives, and the noise under which fits are made.
    base : Fit
        Whose cost is what gains are counted from.
    hypothesis : Hypothesis
        What is added to the base.
    begins : sequence of (Point, mapping)
        Points of the base, with numbers of the effect.
    whole : bool
        Whether to take the derivatives by the base's numbers anew in the end. The fit has all its
        derivatives only where they were, or where this is not asked for.

    Returns
    -------
    Tried or None
        None where it cannot be simulated.

    """
    starts: dict[bytes, tuple[float, Point]] = {}
    for point, numbers in begins:
        try:
            start = hypothesis.point(point, numbers)
            cost = evidence.cost(evidence.residuals(evidence.predict(start)), start)
        except LgHuskyError:
            continue
        # Far from a base that has absorbed the effect no start is as good as there, however
        # far down it leads: each point is a beginning then.
        key = point.places.tobytes() if is_distorted(base) else b''
        if key not in starts or cost < starts[key][0]:
            starts[key] = cost, start
    for key, point in {point.places.tobytes(): point for point, _ in begins}.items():
        likeliest = narrowed(evidence, hypothesis, point)
        if likeliest is not None:
            starts[b'narrowed' + key] = 0.0, hypothesis.point(point, likeliest)
    size = len(base.point.unknowns)
    few = int(setting('whole_rounds'))
    found: list[Tried] = []
    for _, start in starts.values():
        own = range(size, len(start.unknowns))
        slopes = [np.hstack([one, np.zeros((one.shape[0], len(own)))]) for one in base.slopes]
        # On the brink of running away, some do.
        with suppress(LgHuskyError):
            best = evidence.fit(start, slopes, rounds=few, renew=own)
            if best.cost < base.cost + setting('lost'):
                best = evidence.fit(best.point, best.slopes, renew=own)
            found.append(Tried(hypothesis, best, base.cost - best.cost, evidence.count))
            # Derivatives of the best alone may be asked for.
            found.sort(key=lambda one: one.fit.cost)
            kept = found[:0 if whole else 1]
            found = [*kept, *(one.light for one in found[len(kept):])]
    for one in found:
        with suppress(LgHuskyError):
            if whole and one.fit.cost < base.cost + setting('lost'):
                best = evidence.fit(one.fit.point, rounds=few)
                return replace(one, fit=best, gain=base.cost - best.cost)
            return one
    return None


def forward_step(evidence: Evidence, base: Fit, pool: Sequence[Hypothesis],
                 nominal: Point | None, laws: Laws | None = None,
                 seeds: Sequence[Tried] = ()) -> Round:
    """
    Look at hypotheses, fit the best of them and compare them under one noise.

    Parameters
    ----------
    evidence : Evidence
        With the noise of the base.
    base : Fit
        Fit that a hypothesis is added to.
    pool : sequence of Hypothesis
        Hypotheses that can be adopted.
    nominal : Point, optional
        Another point of the base's structure to begin from: the nominal one.
    laws : Laws, optional
        Of what was found before; none if not given.
    seeds : sequence of Tried
        What was found on another way than from the base.

    Returns
    -------
    Round

    """
    seen = _looks(evidence, base, pool, None if nominal is not None else ())
    few = int(setting('fitted'))
    tried = fitted(evidence, base, seen[:few], [base.point], whole=False)
    ranking = Ranking(evidence, base, laws, sum(len(h.trials()) for h in pool))
    tried = sorted([*tried, *seeds], key=lambda t: -t.score)
    chance = ranking.rough_chance(tried[0]) if tried else 1.0
    if chance > setting('hopeless'):
        return Round(evidence, base, tuple(tried), False, chance, tuple(seen))
    own = evidence.renoised(tried[0].fit)
    for number in range(int(setting('noise_turns'))):
        best = tried[0]
        evidence = own if number == 0 else evidence.renoised(best.fit)
        points = [base.point] + ([nominal] if nominal is not None else [])
        base = min((evidence.fit(with_jitter(p, evidence), base.slopes) for p in points),
                   key=lambda f: f.cost)
        if _is_real(best):
            # Anything less leaves the noise, and so what is to be seen, nearly as it was.
            seen = _looks(evidence, base, pool, [t.hypothesis.effect for t in tried])
        known = [Look(t.hypothesis, numbers_of(t), math.inf)
                 for t in tried[:int(setting('known_best'))]]
        once = {one.hypothesis.label: one for one in reversed(known)}
        chosen = [one for one in seen[:few] if one.hypothesis.label not in once]
        guide = replace(base.point, places=best.fit.point.places[:base.point.places.size])
        tried = fitted(evidence, base, [*chosen, *once.values()], [base.point, guide],
                       [*seen, *known])
        if not tried or tried[0].hypothesis.effect == best.hypothesis.effect:
            break
    ranking = replace(ranking, evidence=evidence, base=base)
    first = int(setting('fitted_whole'))
    tried = ranking.ordered([*(_best_form(evidence, base, t) for t in tried[:first]),
                             *tried[first:]])
    tried = _from_the_start(evidence, base, tried)
    chance = ranking.chance(tried[0])
    beyond = is_beyond_chance(chance)
    small = beyond and not _is_real(tried[0]) and not relieves(base, tried[0].fit)
    return Round(evidence, base, tuple(tried), beyond and not small, chance, tuple(seen), small)


def _is_real(tried: Tried) -> bool:
    return is_rather_real(tried.gain, tried.count, tried.hypothesis.effect)


def _best_form(evidence: Evidence, base: Fit, tried: Tried) -> Tried:
    # Of the forms that one stands for: numbers more are for those that do not do as well without.
    there = base.point.at(tried.fit.point.places[:base.point.places.size])
    found = [attempt(evidence, base, other, [(there, {**other.starts[0], **numbers_of(tried)})])
             for other in tried.hypothesis.others]
    return max([tried, *(one.light for one in found if one is not None)], key=lambda t: t.score)


def _from_the_start(evidence: Evidence, base: Fit, tried: list[Tried]) -> list[Tried]:
    # Of two that are not told apart the smaller is taken: an onset is for those that do not do
    # as well without it, beginning from what it found.
    best = tried[0]
    if best.hypothesis.onset is None or best.hypothesis.effect.kind.needs_onset:
        return tried
    places = best.fit.point.places[:base.point.places.size]
    again = attempt(evidence, base, best.hypothesis.at(None),
                    [(base.point.at(places), numbers_of(best))])
    if again is None or not is_near(evidence, best.fit, again.fit, best.score - again.score,
                                    best.gain):
        return tried
    return [again.light,
            *(t for t in tried[1:] if t.hypothesis.effect != again.hypothesis.effect)]


def _looks(evidence: Evidence, base: Fit, pool: Sequence[Hypothesis],
           promising: Sequence[Effect] | None) -> list[Look]:
    # With an onset: every effect, or those that promise most with and without one. Of the forms
    # that one stands for, the best.
    pool = [form for h in pool for form in (h, *h.others)]
    always = [h for h in pool if not h.effect.kind.needs_onset]
    seen = look(evidence, base, always)
    late = list(pool)
    if promising is not None:
        names = {e.id for e in promising[:int(setting('onset_effects'))]}
        names |= {one.hypothesis.effect.id for one in seen[:int(setting('onset_effects'))]}
        late = [h for h in pool if h.effect.id in names or h.effect.kind.needs_onset]
    seen += onset_looks(evidence, base, late, seen)
    penalty = 0.5 * math.log(evidence.count)
    seen.sort(key=lambda one: penalty * one.hypothesis.size - one.gain)
    best: dict[tuple[object, ...], Look] = {}
    for one in seen:
        best.setdefault((one.hypothesis.family, one.hypothesis.onset is None), one)
    return list(best.values())


def fitted(evidence: Evidence, base: Fit, looks: Sequence[Look], points: Sequence[Point],
           further: Sequence[Look] = (), *, whole: bool = True, leading_on: bool = False
           ) -> list[Tried]:
    """
    Fit hypotheses from where looks and points say, order by score.

    All from every beginning with the base's derivatives kept, then the best ones whole.

    Parameters
    ----------
    evidence : Evidence
        Drives, and the noise under which fits are made.
    base : Fit
        Fit that hypotheses are added to.
    looks : sequence of Look
        Hypotheses with numbers to begin with; those that promise too little are left out.
    points : sequence of Point
        Of the base, from where a fit may begin.
    further : sequence of Look
        Whose numbers are beginnings, too.
    whole : bool
        Whether to finish the fits of the best ones.
    leading_on : bool
        Whether other fits go on from where they end, which takes all derivatives.

    Returns
    -------
    list of Tried

    """
    least = max(setting('least_look'), setting('look_part') * max(
        (one.gain for one in looks if one.gain < math.inf), default=0.0))

    def tried(one: Look) -> Tried | None:
        numbers = [one.numbers, *(other.numbers for other in further
                                  if other.hypothesis.label == one.hypothesis.label
                                  and other is not one)]
        if len(points) > 1:
            # What a look promises from one point says little at another.
            numbers += one.hypothesis.starts
        made = attempt(evidence, base, one.hypothesis, list(itertools.product(points, numbers)),
                       whole=False)
        return made if made is None or leading_on else made.light
    results = evidence.pool.map(tried, [one for one in looks if one.gain >= least])
    rough = [one for one in results if one is not None]
    rough.sort(key=lambda t: -t.score)
    # An onset is for those whose onset gains more than it costs.
    always = {t.hypothesis.effect: t.score for t in rough if t.hypothesis.onset is None}
    rough = [t for t in rough if t.hypothesis.onset is None or t.score > always.get(
        replace(t.hypothesis.effect, late=False), -math.inf)]
    if not whole:
        return rough

    def whole_of(own: Tried) -> Tried:
        if own.hypothesis.onset is not None:
            own = refined(evidence, base, own, attempt, numbers_of)
        places = own.fit.point.places[:base.point.places.size]
        again = attempt(evidence, base, own.hypothesis, [(base.point.at(places), numbers_of(own))])
        return (again if again is not None and again.gain >= own.gain else own).light
    few = int(setting('fitted_whole'))
    found = [*evidence.pool.map(whole_of, rough[:few]), *rough[few:]]
    found.sort(key=lambda t: -t.score)
    once: dict[tuple[object, object], Tried] = {}
    for kept in found:
        once.setdefault((kept.hypothesis.effect, kept.hypothesis.onset is None), kept)
    return list(once.values())
