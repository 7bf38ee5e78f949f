# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Forward steps with noise that is estimated again, then backward elimination.

A round looks at every hypothesis, fits the most promising ones, takes the noise anew at the best
and compares all of them under that one noise: gains are comparable only under one whitener.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
import math

from lg_husky_sim.diagnosis.decision.adoption import chance_of, dispersion, is_beyond_chance
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit, Point
from lg_husky_sim.diagnosis.evidence.observation import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import loosened, start_of
from lg_husky_sim.diagnosis.hypotheses.hypothesis import (
    hypotheses,
    Hypothesis,
    neutral_of,
    Numbers,
)
from lg_husky_sim.diagnosis.selection.conventions import best_reading
from lg_husky_sim.diagnosis.selection.elimination import eliminated
from lg_husky_sim.diagnosis.selection.onsets import onset_looks, refined
from lg_husky_sim.diagnosis.selection.screening import Look, look
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.husky.effects import Effect
import numpy as np

Progress = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class Tried:
    """
    A hypothesis that was fitted.

    Parameters
    ----------
    hypothesis : Hypothesis
    fit : Fit
    gain : float
        What it lowers the cost of the base by, under one noise [nats].
    """

    hypothesis: Hypothesis
    fit: Fit
    gain: float
    count: int

    @property
    def score(self) -> float:
        """Gain less half the logarithm of the number of readings for each number it costs."""
        return self.gain - 0.5 * self.hypothesis.size * math.log(self.count)


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
    """

    evidence: Evidence
    base: Fit
    tried: tuple[Tried, ...]
    adopted: bool
    chance: float
    looks: tuple[Look, ...] = field(default=())


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


def calibrated(evidence: Evidence, start: Point, times: int = 2) -> tuple[Evidence, Fit]:
    """
    Fit a structure and the noise, in turns.

    Parameters
    ----------
    evidence : Evidence
    start : Point
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
    """Return a point whose delays may be as large as the jitter of the stamps suggests."""
    noise = evidence.noise.values
    unknowns = loosened(point.unknowns, {
        'command_delay': noise['command_jitter'], 'delay_wheels': noise['wheel_jitter'],
        'delay_imu': noise['imu_jitter'], 'delay_pose': noise['pose_jitter']})
    return replace(point, unknowns=unknowns).at(point.places)


def attempt(evidence: Evidence, base: Fit, hypothesis: Hypothesis, begins: Sequence[
        tuple[Point, Numbers]], whole: bool = True) -> Tried | None:
    """
    Fit a hypothesis from several beginnings.

    Parameters
    ----------
    evidence : Evidence
    base : Fit
        Whose cost is what gains are counted from.
    hypothesis : Hypothesis
    begins : sequence of (Point, mapping)
        Points of the base, with numbers of the effect.
    whole : bool
        Whether to take the derivatives by the base's numbers anew in the end.

    Returns
    -------
    Tried or None
        None where it cannot be simulated.
    """
    starts = []
    for point, numbers in begins:
        try:
            start = hypothesis.point(point, numbers)
            starts.append((evidence.cost(evidence.residuals(evidence.predict(start)), start),
                           start))
        except LgHuskyError:
            continue
    if not starts:
        return None
    start = min(starts, key=lambda one: one[0])[1]
    size = len(base.point.unknowns)
    own = range(size, len(start.unknowns))
    slopes = [np.hstack([one, np.zeros((one.shape[0], len(own)))]) for one in base.slopes]
    few = int(setting('whole_rounds'))
    best = evidence.fit(start, slopes, rounds=few, renew=own)
    if best.cost < base.cost + setting('lost'):
        best = evidence.fit(best.point, best.slopes, renew=own)
        if whole:
            best = evidence.fit(best.point, rounds=few)
    return Tried(hypothesis, best, base.cost - best.cost, evidence.count)


def play_round(evidence: Evidence, base: Fit, pool: Sequence[Hypothesis],
               nominal: Point | None, least: float = 0.0) -> Round:
    """
    Look at hypotheses, fit the best of them and compare them under one noise.

    Parameters
    ----------
    evidence : Evidence
        With the noise of the base.
    base : Fit
    pool : sequence of Hypothesis
    nominal : Point, optional
        Another point of the base's structure to begin from: the nominal one.
    least : float
        Gain below which nothing is adopted [nats].

    Returns
    -------
    Round
    """
    seen = _looks(evidence, base, pool, None if nominal is not None else ())
    few = int(setting('fitted'))
    if not seen or setting('look_trust') * seen[0].gain < least:
        return Round(evidence, base, (), False, 1.0, tuple(seen))
    tried = _fitted(evidence, base, seen[:few], [base.point], whole=False)
    starts = sum(len(h.trials()) for h in pool)
    chance = _chance(evidence, tried[0], starts) if tried else 1.0
    if chance > setting('hopeless') or tried[0].gain < 0.5 * least:
        return Round(evidence, base, tuple(tried), False, chance, tuple(seen))
    for _ in range(2):
        best = tried[0]
        evidence = evidence.renoised(best.fit)
        points = [base.point] + ([nominal] if nominal is not None else [])
        base = min((evidence.fit(with_jitter(p, evidence), base.slopes) for p in points),
                   key=lambda f: f.cost)
        seen = _looks(evidence, base, pool, [t.hypothesis.effect for t in tried])
        chosen = list(seen[:few])
        known = {one.hypothesis.label for one in chosen}
        chosen += [Look(t.hypothesis, _numbers(t), 0.0, np.zeros((0, 0))) for t in tried[:3]
                   if t.hypothesis.label not in known]
        guide = replace(base.point, places=best.fit.point.places[:base.point.places.size])
        tried = _fitted(evidence, base, chosen, [base.point, guide])
        if not tried or tried[0].hypothesis.effect == best.hypothesis.effect:
            break
    tried.sort(key=lambda t: (is_negligible(t), -t.score))
    tried = _from_the_start(evidence, base, tried)
    best = tried[0]
    chance = 1.0 if is_negligible(best) else _chance(evidence, best, starts)
    return Round(evidence, base, tuple(tried), is_beyond_chance(chance), chance, tuple(seen))


def _from_the_start(evidence: Evidence, base: Fit, tried: list[Tried]) -> list[Tried]:
    # An onset is for those that do not do as well without it, beginning from what it found.
    best = tried[0]
    if best.hypothesis.onset is None or best.hypothesis.effect.kind.needs_onset:
        return tried
    places = best.fit.point.places[:base.point.places.size]
    again = attempt(evidence, base, best.hypothesis.at(None),
                    [(base.point.at(places), _numbers(best))])
    if again is None or again.score < best.score:
        return tried
    return [again, *(t for t in tried[1:] if t.hypothesis.effect != again.hypothesis.effect)]


def _chance(evidence: Evidence, tried: Tried, starts: int) -> float:
    own = tried.fit.jacobian[:, -len(tried.hypothesis.free):]
    return chance_of(tried.gain, tried.hypothesis, starts, evidence,
                     dispersion(evidence, tried.fit.whitened, own))


def is_negligible(tried: Tried) -> bool:
    """Return whether every number of a fitted effect is less than what counts."""
    values = tried.fit.point.values
    return all(abs(values[p.name] - (neutral_of(p) or 0.0)) < p.negligible
               for p in tried.hypothesis.free)


def _looks(evidence: Evidence, base: Fit, pool: Sequence[Hypothesis],
           promising: Sequence[Effect] | None) -> list[Look]:
    # With an onset: every effect, or those that promise most with and without one.
    always = [h for h in pool if not h.effect.kind.needs_onset]
    seen = look(evidence, base, always)
    late = list(pool)
    if promising is not None:
        names = {e.id for e in promising[:int(setting('onset_effects'))]}
        names |= {one.hypothesis.effect.id for one in seen[:int(setting('onset_effects'))]}
        late = [h for h in pool if h.effect.id in names or h.effect.kind.needs_onset]
    seen += onset_looks(evidence, base, late, seen)
    penalty = 0.5 * math.log(evidence.count)
    return sorted(seen, key=lambda one: penalty * one.hypothesis.size - one.gain)


def _numbers(tried: Tried) -> Numbers:
    values = tried.fit.point.values
    return {p.name: values[p.name] for p in tried.hypothesis.free}


def _fitted(evidence: Evidence, base: Fit, looks: Sequence[Look], points: Sequence[Point],
            whole: bool = True) -> list[Tried]:
    # All from every beginning with the base's derivatives kept, then the best ones whole.
    rough = []
    least = max(setting('least_look'), setting('look_part') * max(
        (one.gain for one in looks), default=0.0))
    for one in looks:
        if one.gain < least and one.columns.size:
            continue
        result = attempt(evidence, base, one.hypothesis, [(p, one.numbers) for p in points],
                         whole=False)
        if result is not None:
            rough.append(result)
    rough.sort(key=lambda t: -t.score)
    # An onset is for those whose onset gains more than it costs.
    always = {t.hypothesis.effect: t.score for t in rough if t.hypothesis.onset is None}
    rough = [t for t in rough if t.hypothesis.onset is None or t.score > always.get(
        replace(t.hypothesis.effect, late=False), -math.inf)]
    if not whole:
        return rough
    found = []
    for result in rough[:int(setting('fitted_whole'))]:
        own = result
        if own.hypothesis.onset is not None:
            own = refined(evidence, base, own, attempt, _numbers)
        places = own.fit.point.places[:base.point.places.size]
        again = attempt(evidence, base, own.hypothesis, [(base.point.at(places), _numbers(own))])
        found.append(again if again is not None and again.gain >= own.gain else own)
    found += rough[len(found):]
    found.sort(key=lambda t: -t.score)
    once: dict[tuple[object, object], Tried] = {}
    for kept in found:
        once.setdefault((kept.hypothesis.effect, kept.hypothesis.onset is None), kept)
    return list(once.values())


def _as_logged(evidence: Evidence, base: Fit) -> tuple[Fit, bool]:
    # A missing effect can pass for another reading of the sensors. Where an effect promises more
    # than the reading gains, the reading waits for what the effect really gains.
    chosen = best_reading(evidence, base)
    if chosen is base:
        return base, False
    pool = [h for h in hypotheses(base.point.structure) if not h.effect.kind.needs_onset]
    seen = look(evidence, base, pool)[:int(setting('readings_fitted'))]
    gains = [t.gain for t in _fitted(evidence, base, seen, [base.point], whole=False)]
    waits = max(gains, default=0.0) > (1.0 + setting('near_margin')) * (base.cost - chosen.cost)
    return (base if waits else chosen), waits


def _read_as(evidence: Evidence, base: Fit, chosen: Fit) -> tuple[Evidence, Fit]:
    if chosen is base:
        return evidence, base
    evidence = evidence.renoised(chosen)
    return evidence, evidence.fit(with_jitter(chosen.point, evidence))


def _nominal(point: Point) -> Point:
    # The robot as it should be, read like a point.
    centres = start_of(point.unknowns)
    for place, unknown in enumerate(point.unknowns):
        if unknown.kind == 'log':
            centres[place] = point.places[place]
    return point.at(centres)


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
    # Under a wrong reading the numbers of the robot would take its place: first of all at nominal.
    start = _nominal(_as_logged(evidence, evidence.fit(start, rounds=1))[0].point)
    evidence, base = calibrated(evidence.about(start), start)
    chosen, postponed = _as_logged(evidence, base)
    evidence, base = _read_as(evidence, base, chosen)
    usual = Reading()
    start = _nominal(base.point)
    plain = base
    rounds: list[Round] = []
    found: list[Hypothesis] = []
    least = 0.0
    while len(rounds) < int(setting('most_effects')):
        number = len(rounds)
        progress(f'looking for effect {number + 1}', 0.1 + 0.25 * number)
        one = play_round(evidence, base, hypotheses(base.point.structure),
                         None if found else start, least)
        best = one.tried[0] if one.tried else None
        evidence = one.evidence
        adopted = best is not None and one.adopted and best.gain >= least
        if postponed and not found:
            chosen = best_reading(evidence, one.base)
            if not adopted or best is None or one.base.cost - chosen.cost >= best.gain:
                # The log was made otherwise, or else nothing says so: look again.
                postponed = False
                evidence, base = _read_as(evidence, one.base, chosen)
                start = _nominal(base.point)
                continue
        rounds.append(one)
        if number == 0:
            plain = one.base
        if not adopted or best is None:
            base = one.base
            break
        found.append(best.hypothesis)
        least = setting('least_part') * rounds[0].tried[0].gain
        evidence, base = calibrated(evidence, best.fit.point, 1)
        if postponed or base.point.reading != usual:
            evidence, base = _read_as(evidence, base, best_reading(evidence, base))
            postponed = False
    if len(found) > 1:
        base, kept = eliminated(evidence, plain.point, base, found, least)
        rounds = [r for r, h in zip(rounds, found, strict=False) if h in kept] + rounds[
            len(found):]
        found = kept
    return Search(plain, base, evidence, tuple(rounds), tuple(found))
