# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""From a search to an answer: verdict, names, numbers, what cannot be told apart, confidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
import math

from lg_husky_sim.diagnosis.decision.confidence import confidence, Features
from lg_husky_sim.diagnosis.evidence import student
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.evidence.point import Point
from lg_husky_sim.diagnosis.evidence.products import normal_matrix
from lg_husky_sim.diagnosis.evidence.unknowns import Unknown
from lg_husky_sim.diagnosis.hypotheses.hypothesis import neutral_of
from lg_husky_sim.diagnosis.hypotheses.past_motion import PAST
from lg_husky_sim.diagnosis.hypotheses.smooth_efforts import Effort, READINGS
from lg_husky_sim.diagnosis.localisation import Missing, where_it_shows
from lg_husky_sim.diagnosis.nameless import felt, left_over, needed_evidence
from lg_husky_sim.diagnosis.result import Estimate, Finding, Indistinguishable, Verdict
from lg_husky_sim.diagnosis.rivals import rivals_of
from lg_husky_sim.diagnosis.selection.search import Search
from lg_husky_sim.diagnosis.selection.ties import gains_of, is_near
from lg_husky_sim.diagnosis.separation import separated_by
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.diagnosis.wording import sentence
from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.network import on_side
from lg_husky_sim.husky.parameters import Parameters
import numpy as np

#: Parameter whose sign says to which side an effect acts: positive to the left.
SIDE_OF = {'yaw_pull': 'pull_moment'}


def estimates(fit: Fit, names: Sequence[str], units: Parameters) -> tuple[Estimate, ...]:
    """
    Return fitted numbers with their 95 % intervals.

    Parameters
    ----------
    fit : Fit
        Of a model to recordings; intervals are about its numbers.
    names : sequence of str
        Unknowns.
    units : Parameters
        Holds every name.

    Returns
    -------
    tuple of Estimate
        Intervals from the curvature of the cost, priors included, inside the bounds; without the
        numbers that are not determined: their intervals are the bounds of the search.

    """
    return tuple(
        _estimate(unknown, place, half, units.entry(unknown.name).unit)
        for unknown, place, half in _intervals(fit)
        if unknown.name in names and not _is_undetermined(unknown, place, half))


def undetermined(fit: Fit, names: Sequence[str]) -> tuple[str, ...]:
    """Return the fitted numbers whose intervals are the bounds of their search."""
    return tuple(unknown.name for unknown, place, half in _intervals(fit)
                 if unknown.name in names and _is_undetermined(unknown, place, half))


def _is_undetermined(unknown: Unknown, place: float, half: float) -> bool:
    return place - half <= unknown.lower and place + half >= unknown.upper


def _intervals(fit: Fit) -> list[tuple[Unknown, float, float]]:
    # Each number of the robot or an effect with its place and half of its 95 % interval there.
    weight = student.weights(fit.whitened)
    normal = normal_matrix(fit.jacobian, weight) + np.diag(fit.point.weights ** 2)
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-12))
    covariance = np.linalg.pinv(normal / np.outer(scale, scale)) / np.outer(scale, scale)
    # A number that moves no reading has no information, of which a pseudo-inverse makes certainty.
    half = np.where(np.diag(normal) > 1e-12,
                    setting('two_sided') * np.sqrt(np.maximum(np.diag(covariance), 0.0)), math.inf)
    return [(unknown, place, wide) for unknown, place, wide in zip(
        fit.point.unknowns, fit.point.places.tolist(), half.tolist(), strict=True)
        if unknown.kind != 'log']


def without_undetermined(evidence: Evidence, fit: Fit) -> Point:
    """
    Return a fitted point with the numbers that are not determined where they do nothing.

    Parameters
    ----------
    evidence : Evidence
        Drives, and the noise under which the fit was made.
    fit : Fit
        Some of its numbers may not be determined by the data.

    Returns
    -------
    Point
        Numbers of the robot are nominal there. One that cannot be so, because the data are
        explained worse then than at the end of a 95 % interval or because there is no such
        model, stays as it was fitted.

    """
    point = fit.point
    idle = {p.name: neutral_of(p) for e in point.structure.effects for p in e.parameters()}
    room = 0.5 * setting('two_sided') ** 2
    most = evidence.cost(evidence.residuals(fit.predicted), point) + room
    for name in undetermined(fit, list(point.numbers)):
        place = next(k for k, u in enumerate(point.unknowns) if u.name == name)
        unknown, value = point.unknowns[place], idle.get(name)
        places = np.array(point.places)
        if unknown.kind == 'model':
            places[place] = unknown.centre
        elif value is not None:
            places[place] = unknown.place(value)
        try:
            moved = point.at(places)
            cost = evidence.cost(evidence.residuals(evidence.predict(moved)), moved)
        except LgHuskyError:
            continue
        if cost <= most:
            point = moved
    return point


def _estimate(unknown: Unknown, place: float, half: float, unit: str) -> Estimate:
    low, high = max(place - half, unknown.lower), min(place + half, unknown.upper)
    return Estimate(unknown.name, unknown.value(place), unit, unknown.value(low),
                    unknown.value(high))


def indistinguishable(search: Search) -> tuple[Indistinguishable, ...]:
    """Return the sets of effects between which the data do not decide."""
    found = []
    for one in search.adopted:
        best = one.tried[0]
        near = [t for t in one.tried[1:] if t.gain > 0.0
                and t.hypothesis.effect.id != best.hypothesis.effect.id
                and is_near(one.evidence, best.fit, t.fit, best.score - t.score, best.gain)]
        if near:
            names = tuple(dict.fromkeys([best.hypothesis.effect.id,
                                         *(t.hypothesis.effect.id for t in near)]))[:4]
            sensors, manoeuvres = separated_by(names)
            found.append(Indistinguishable(names, sensors, manoeuvres))
    return tuple(found)


def _acting_side(effect: Effect, numbers: Sequence[Estimate]) -> str:
    value = next((e.value for e in numbers if e.name == SIDE_OF.get(effect.id)), 0.0)
    return effect.side if value == 0.0 else 'left' if value > 0.0 else 'right'


def findings(search: Search) -> tuple[Finding, ...]:
    """Return what was adopted, strongest first, with numbers from the joint fit."""
    found = []
    total = sum(max(r.tried[0].gain, 0.0) for r in search.adopted) or 1.0
    for one in search.adopted:
        best = one.tried[0]
        effect = next(e for e in search.final.point.structure.effects
                      if (e.id, e.side) == (best.hypothesis.effect.id,
                                            best.hypothesis.effect.side))
        names = [p.name for p in best.hypothesis.free]
        numbers = estimates(search.final, names, search.final.point.numbers)
        onset = search.final.point.structure.onset if effect.late else None
        regime = where_it_shows(one.evidence, gains_of(one.base, best.fit))
        side = _acting_side(effect, numbers)
        found.append(Finding(
            effect.id, side, effect.kind.subsystem.value,
            on_side(effect.kind.elements, side), regime, onset, numbers, best.gain, one.chance,
            min(1.0, best.gain / total), rivals_of(one),
            sentence(effect, onset, numbers, regime,
                     undetermined=undetermined(search.final, names))))
    return tuple(sorted(found, key=lambda f: -f.held_out_gain))


@dataclass(frozen=True)
class Answer:
    """A verdict with its confidence, and the features that made it."""

    verdict: Verdict
    sure: float
    features: Features


def answer(search: Search, rest: Sequence[Effort], free: Sequence[Missing]) -> Answer:
    """
    Decide between the names, unknown and nothing.

    Parameters
    ----------
    search : Search
        With what every round tried and what was adopted.
    rest : sequence of Effort
        Smooth efforts in what the search leaves, largest evidence first.
    free : sequence of Missing
        Efforts over time in what it leaves.

    Returns
    -------
    Answer

    """
    needed = needed_evidence(rest, free)
    rest, free = felt(rest, free, search.final.point.structure.robot)
    left = max([0.0, *(e.evidence for e in rest), *(m.bursts for m in free)])
    is_left = left > needed
    explained = max([0.0, *(e.explained for e in rest), *(m.bursts for m in free)])
    first = search.rounds[0]
    tried = first.tried
    if not search.adopted:
        gain = max(tried[0].gain, 0.0) if tried else 0.0
        features = Features(gain, explained / max(gain, 1.0), first.chance, left, needed)
        return _sure(Verdict.UNKNOWN if is_left else Verdict.NOTHING_MISSING, features)
    told = max(explained_by(search), tried[0].gain)
    features = Features(min(one.tried[0].gain for one in search.adopted), explained / told,
                        first.chance, left, needed)
    is_unknown = is_left and features.share > setting('unknown_share') and not (
        _is_its_form(search, rest))
    return _sure(Verdict.UNKNOWN if is_unknown else Verdict.KNOWN, features)


def _is_its_form(search: Search, rest: Sequence[Effort]) -> bool:
    # Whether what is left is a law of another form: at the balance, and over the quantity, where
    # the effects explain most, and most of what there is. One that remembers is none, and the
    # factor and the offset of a sensor have only one.
    most = max(rest, key=lambda one: one.explained, default=None)
    if most is None or most.argument in PAST or most.balance in READINGS:
        return False
    left = _by_place(rest)
    whole = _by_place(left_over(search.evidence, search.evidence.fit(search.plain.point)))
    best = max(whole, key=lambda place: whole[place] - left.get(place, 0.0))
    return best == (most.balance, most.argument) and (
        whole[best] - left[best] > setting('form_share') * whole[best])


def _by_place(rest: Sequence[Effort]) -> dict[tuple[str, str], float]:
    # What efforts explain, smooth ones and those that repeat, by balance and quantity.
    found: dict[tuple[str, str], float] = {}
    for one in rest:
        place = one.balance, one.argument
        found[place] = found.get(place, 0.0) + one.explained
    return found


def _sure(verdict: Verdict, features: Features) -> Answer:
    return Answer(verdict, confidence(verdict, features), features)


def explained_by(search: Search) -> float:
    """
    Return what the adopted effects explain.

    Parameters
    ----------
    search : Search
        With the fits of the plain model and of the one with all that was adopted.

    Returns
    -------
    float
        What they gain under the noise that remains with them [nats], over the robot as it may be:
        its numbers stay within `most_tolerances` where they would do the effect's work.

    """
    evidence, plain = search.evidence, search.plain.point
    room = setting('most_tolerances')
    held = tuple(u if u.kind != 'model' else replace(
        u, lower=max(u.lower, u.centre - room * u.deviation),
        upper=min(u.upper, u.centre + room * u.deviation)) for u in plain.unknowns)
    inside = replace(plain, unknowns=held).at(plain.places)
    if not np.array_equal(inside.places, plain.places):
        plain = evidence.fit(inside).point
    return (evidence.cost(evidence.residuals(evidence.predict(plain)), plain)
            - search.final.cost)
