# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Find the moment or the place at which a late effect begins, finely."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from lg_husky_sim.diagnosis.fits import extras_of, Fit, fit_structure
from lg_husky_sim.diagnosis.onsets import ONSET_STEP, place_onsets, time_onsets
from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.husky.effects import Onset, OnsetKind
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.identification.noise import Metric
from lg_husky_sim.identification.problem import Observations
import numpy as np

#: Fine steps around the best coarse onset [s, m], and how far they go in coarse steps.
FINE = {OnsetKind.TIME: 0.1, OnsetKind.PLACE_ABOVE: 0.05, OnsetKind.PLACE_BELOW: 0.05}
REACH = 1.2
#: Valleys of the cost along coarse onsets that are looked into, and the points in each: a command
#: that changes makes them narrower than a coarse step. Then how many of them are placed finely.
VALLEYS, INSIDE, PLACED = 4, 11, 2
#: Drop of the cost without the effect before an onset, its numbers unchanged, and after a refit,
#: from which it begins there [nats].
ABSENT, LATE = 5.0, 10.0
#: Both for a change between recordings, whose model is less exact.
LATE_CHANGE = 60.0
#: Onsets within this many nats of the best are as good; their middle is taken.
FLAT = 1.0


def _cost(observations: Observations, fit: Fit, metric: Metric, onset: Onset) -> float:
    try:
        plant = compile_model(replace(fit.structure, onset=onset)).at(fit.parameters)
    except LgHuskyError:
        return np.inf
    predicted = observations.predict(plant, extras_of(fit))
    white = metric.whiten(observations, observations.measured - predicted)
    cost = 0.5 * float(white @ white)
    return cost if np.isfinite(cost) else np.inf


def _middle(onsets: Sequence[Onset], costs: Sequence[float]) -> Onset:
    # Of the onsets that are as good as the best and adjacent to it, the middle one.
    best = int(np.argmin(costs))
    low = high = best
    while low > 0 and costs[low - 1] < costs[best] + FLAT:
        low -= 1
    while high + 1 < len(costs) and costs[high + 1] < costs[best] + FLAT:
        high += 1
    return onsets[(low + high) // 2]


def _valleys(costs: Sequence[float]) -> list[int]:
    # Where the cost is lower than on either side, the lowest first.
    padded = [np.inf, *costs, np.inf]
    found = [i for i, cost in enumerate(costs) if padded[i] >= cost <= padded[i + 2]]
    return sorted(found, key=lambda i: costs[i])[:VALLEYS]


def _around(onset: Onset, moves: Iterable[float]) -> list[Onset]:
    moved = [replace(onset, value=round(onset.value + move, 4)) for move in moves]
    return [o for o in moved if o.value >= 0.0 or onset.kind is not OnsetKind.TIME]


def _coarse(observations: Observations, onset: Onset, change: Onset | None) -> list[Onset]:
    # Onsets of the same kind over all data, in the order of time or place.
    family = (time_onsets if onset.kind is OnsetKind.TIME else place_onsets)(observations)
    named = onset.recording if onset.kind is not OnsetKind.TIME else ''
    coarse = [replace(o, recording=named or o.recording) for o, _ in family.onsets
              if o.kind is onset.kind]
    coarse = [o for o in coarse if bool(o.recording) == bool(onset.recording)]
    if change is not None:
        first = observations.recordings.index(change.recording)
        coarse = [o for o in coarse if o.recording in observations.recordings[first:]]
    if onset not in coarse:
        coarse.append(onset)
    if onset.recording:
        # Onsets in a named recording lie on one line through all recordings.
        coarse.sort(key=lambda o: (observations.recordings.index(o.recording), o.value))
    return coarse


def refined_onsets(observations: Observations, fit: Fit, metric: Metric,
                   change: Onset | None = None) -> tuple[Onset, ...]:
    """
    Return better onsets for a fitted late effect.

    Parameters
    ----------
    observations : Observations
    fit : Fit
        With an onset in its structure.
    metric : Metric
    change : Onset, optional
        Before which no onset is tried.

    Returns
    -------
    tuple of Onset
        The best one first, then one of another valley of the cost: the numbers of the fit are
        those of its own onset and speak for it. Empty where the structure has no onset.
    """
    onset = fit.structure.onset
    if onset is None:
        return ()

    def costs_of(onsets: Sequence[Onset]) -> list[float]:
        return [_cost(observations, fit, metric, o) for o in onsets]
    coarse = _coarse(observations, onset, change)
    step = ONSET_STEP
    if onset.kind is not OnsetKind.TIME and len(coarse) > 1:
        step = abs(coarse[1].value - coarse[0].value)
    costs = costs_of(coarse)
    centres = [(min(costs), _middle(coarse, costs))]
    for valley in _valleys(costs):
        inside = _around(coarse[valley], (np.linspace(-1.0, 1.0, INSIDE) * step).tolist())
        found = costs_of(inside)
        if valley != int(np.argmin(costs)) or min(found) < min(costs) - FLAT:
            centres.append((min(found), _middle(inside, found)))
    count = int(np.ceil(REACH * step / FINE[onset.kind]))
    placed: list[tuple[float, Onset]] = []
    for _, centre in sorted(centres, key=lambda one: one[0]):
        if len(placed) < PLACED and not any(
                o.recording == centre.recording and abs(o.value - centre.value) <= REACH * step
                for _, o in placed):
            fine = _around(centre, (k * FINE[onset.kind] for k in range(-count, count + 1)))
            found = costs_of(fine)
            placed.append((min(found), _middle(fine, found)))
    return tuple(o for _, o in sorted(placed, key=lambda one: one[0]))


def begun_late(observations: Observations, fit: Fit, nominal: Parameters, metric: Metric,
               change: Onset | None = None) -> Fit:
    """
    Let the newest effect begin late, if it is absent before.

    Signatures judge an onset along a straight line; here the effect, as it was fitted, is taken
    away before each onset, which helps only where it was not there.

    Parameters
    ----------
    observations : Observations
    fit : Fit
        Without an onset, or with that of a change.
    nominal : Parameters
    metric : Metric
    change : Onset, optional
        The beginning of the later recordings, if a change was asked for: a moment inside them is
        tried.

    Returns
    -------
    Fit
        The same where the effect is there from the beginning.
    """
    structure = fit.structure
    effect = structure.effects[-1]
    families = (time_onsets(observations), place_onsets(observations))
    onsets = [onset for family in families for onset, _ in family.onsets]
    if change is not None:
        later = observations.recordings[observations.recordings.index(change.recording):]
        onsets = [onset for onset, _ in families[0].onsets if onset.recording in later]
    if structure.onset != change or not onsets:
        return fit
    absent, least = (ABSENT, LATE) if change is None else (LATE_CHANGE, LATE_CHANGE)
    late = replace(structure, effects=(*structure.effects[:-1], replace(effect, late=True)),
                   onset=onsets[0])
    costs = [_cost(observations, replace(fit, structure=late), metric, o) for o in onsets]
    best = int(np.argmin(costs))
    white = metric.whiten(observations, observations.measured - fit.solution.predicted)
    before = 0.5 * float(white @ white)
    if before - costs[best] < absent:
        return fit
    sizes = {**fit.parameters, **fit.solution.values}
    again = fit_structure(observations, replace(late, onset=onsets[best]), nominal, metric,
                          fit.solution.values, sizes, 4)
    if again is None:
        return fit
    white = metric.whiten(observations, observations.measured - again.solution.predicted)
    return again if before - 0.5 * float(white @ white) > least else fit
