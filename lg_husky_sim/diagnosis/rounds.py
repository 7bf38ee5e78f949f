# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""One round: screen every candidate, refit the serious ones, compare them, judge the best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

from lg_husky_sim.diagnosis.candidates import Candidate, still_open
from lg_husky_sim.diagnosis.evidence import energy, held_out_cost, instability, strain
from lg_husky_sim.diagnosis.fits import at_nominal, Fit, fit_structure, shared_metric
from lg_husky_sim.diagnosis.jitter import gains_beside_jitter, JITTER
from lg_husky_sim.diagnosis.onsets import Onsets
from lg_husky_sim.diagnosis.refits import look, Looked, Refit, run_refit
from lg_husky_sim.diagnosis.rivals import (
    adopts,
    LEAST_GAIN,
    most_credible,
    rank,
    Rival,
    UNSTABLE,
)
from lg_husky_sim.diagnosis.screening import (
    Projector,
    scan,
    Score,
    Signature,
    without_columns,
)
from lg_husky_sim.diagnosis.shortlist import always, changes, shortlist
from lg_husky_sim.diagnosis.workers import HERE, Workers
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.identification.noise import Metric
from lg_husky_sim.identification.problem import Observations
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Part of the best further effect's gain from which another may be adopted in its place, and the
#: losses over gains of held-out blocks that it may have then.
BESIDE, STEADY = 0.5, 0.1
#: Sizes below which a dead time or a late stamp is no physics [s]: deviation of a command's time.
SLIGHT = {'latency': JITTER, 'stamp_delay': JITTER}
#: Candidates that are refitted in a round.
SERIOUS = 6
#: Of these, those that are refitted to the end.
POLISHED = 5
#: The same where only a change is asked for: its refits have few unknowns.
OF_CHANGES = (9, 6)
#: Most steps of such a refit: one that has not converged makes the wrong rival win.
POLISH = 16
#: Most steps of the last refit, under the metric that judges; how far from the best those that
#: take part may be: nats, and part of its gain.
SETTLE = 4
CONTEND = (100.0, 0.3)


@dataclass(frozen=True, eq=False)
class Round:
    """
    One round of the search.

    Parameters
    ----------
    base : Fit
        What it began with.
    scores : tuple of Score
        The screening, best first.
    rivals : tuple of Rival
        The refitted candidates, best held-out gain first.
    metric : Metric
        Under which they were compared.
    share : float
        Share of the base's unexplained energy that the best one explains.
    adopted : bool
    instability : float
        Of the best one's gain over held-out blocks.
    rest : float
        Energy per value that the best one leaves, in units of the sensors' noise.
    """

    base: Fit
    scores: tuple[Score, ...]
    rivals: tuple[Rival, ...]
    metric: Metric
    share: float
    adopted: bool
    instability: float = 0.0
    rest: float = 1.0


def play_round(observations: Observations, base: Fit, number: int, nominal: Parameters,
               pool: Sequence[Candidate], masks: Sequence[Onsets], folds: FloatArray,
               only_late: bool = False, eager: bool = False,
               workers: Workers = HERE) -> Round:
    """
    Play one round of the search.

    Parameters
    ----------
    observations : Observations
    base : Fit
    number : int
        Effects that were adopted before.
    nominal : Parameters
    pool : sequence of Candidate
    masks : sequence of Onsets
        Onsets to try.
    folds : numpy.ndarray
    only_late : bool
        Whether only effects with an onset are asked for: what changed between recordings.
    eager : bool
        Whether to adopt whatever predicts held-out data better: for a good description, not for
        a name.
    workers : Workers
        What looks at candidates and refits them.

    Returns
    -------
    Round
    """
    asked = still_open(pool, base.structure)
    signatures = [s for found in workers.map(
        look, [Looked(c, base, observations) for c in asked]) for s in found]
    common = shared_metric(observations, base, signatures)
    late = base.structure.onset is None or only_late
    if only_late:
        scores, broad = (
            changes(screen(observations, base, one, signatures, masks), masks[0])
            for one in (common, common.uncorrelated))
    else:
        scores, broad = (screen(observations, base, one, signatures, masks if late else ())
                         for one in (common, common.uncorrelated))
    most, finished = OF_CHANGES if only_late else (SERIOUS, POLISHED)
    serious = shortlist(scores, most)
    chosen = {(s.signature.candidate.label, s.onset is None) for s in serious}
    serious += [s for s in shortlist(broad, most // 2)
                if (s.signature.candidate.label, s.onset is None) not in chosen]
    if not only_late:
        serious += always(serious, broad)
    nominal_fit = None if only_late else at_nominal(observations, base, nominal)
    starts = [near for near in (base, nominal_fit) if near is not None]
    tasks = [(k, near) for k in range(len(serious)) for near in starts]
    lean = [without_columns(score) for score in serious]
    tried = workers.map(run_refit, [Refit(observations, near, nominal, lean[k], common)
                                    for k, near in tasks])
    quick: dict[int, Fit] = {}
    for (k, _), fit in zip(tasks, tried, strict=True):
        if fit is not None and (k not in quick or fit.solution.cost < quick[k].solution.cost):
            quick[k] = fit
    near = sorted(quick.items(), key=lambda pair: pair[1].solution.cost)[:finished]
    polished = workers.map(run_refit, [
        Refit(observations, base, nominal, lean[k], common, POLISH, fit)
        for k, fit in near])
    fits = [(serious[k], fit) for (k, _), fit in zip(near, polished, strict=True)]
    usable = [(score, fit) for score, fit in fits
              if fit is not None and not is_eased(fit) and not is_slight(fit)]
    rebased = fit_structure(observations, base.structure, nominal, common,
                            base.solution.values, base.parameters) or base
    if usable:
        # The base again from where the best candidate ended: a better optimum is no effect.
        best = min(usable, key=lambda pair: pair[1].solution.cost)[1]
        again = fit_structure(observations, base.structure, nominal, common,
                              best.solution.values, base.parameters)
        if again is not None and again.solution.cost < rebased.solution.cost:
            rebased = again
    if not usable:
        count = float(np.count_nonzero(common.scale))
        return Round(rebased, tuple(scores), (), common, 0.0, False, 1.0,
                     energy(observations, rebased, common) / count)
    best = min(usable, key=lambda pair: pair[1].solution.cost)[1]
    final = shared_metric(observations, best, [])
    usable = rescued(observations, base, nominal, usable, final, rebased, workers)
    closest = min(usable, key=lambda pair: left_by(observations, pair[1], final))[1]
    if closest is not best:
        final = shared_metric(observations, closest, [])
    rebased, usable = settled(observations, base, nominal, rebased, usable, final, workers)
    cost_base = held_out_cost(observations, rebased, final, folds)
    # Before a change a good description is wanted; what jitters after it did so before, too.
    kept = gains_beside_jitter(observations, rebased, [fit for _, fit in usable], final) if not (
        only_late or eager) else [math.inf] * len(usable)
    rivals = []
    for (score, fit), beside in zip(usable, kept, strict=True):
        cost = held_out_cost(observations, fit, final, folds)
        gain = left_by(observations, rebased, final) - left_by(observations, fit, final)
        relief = strain(rebased) - strain(fit)
        held_out = min(float(np.sum(cost_base - cost)), most_credible(gain + max(relief, 0.0)))
        rivals.append(Rival(fit.structure.effects[-1], score.onset, fit, gain, held_out, relief,
                            beside))
    rivals.sort(key=lambda r: -rank(r))
    before = energy(observations, rebased, final)
    count = float(np.count_nonzero(final.scale))

    def explained(one: Rival) -> tuple[float, float, float]:
        after = energy(observations, one.fit, final)
        cost = held_out_cost(observations, one.fit, final, folds)
        return ((before - after) / max(before - 0.5 * count, 1e-9),
                instability(observations, cost_base - cost), after / count)
    what = explained(rivals[0])
    share, unstable, _ = what
    adopted = (rivals[0].held_out > LEAST_GAIN[0] and unstable < UNSTABLE[0] and share > 0.0
               if eager else adopts(rivals[0], *what, number, only_late))
    for one in rivals[1:] if number > 0 and not (adopted or eager) else ():
        # What gains most may explain next to nothing: a little friction, beside a second effect.
        other = explained(one)
        if rank(one) > BESIDE * rank(rivals[0]) and other[1] < STEADY and adopts(
                one, *other, number, only_late):
            what, adopted = other, True
            rivals = [one, *(r for r in rivals if r is not one)]
            break
    return Round(rebased, tuple(scores), tuple(rivals), final, what[0], adopted, *what[1:])


def is_slight(fit: Fit) -> bool:
    """Return whether all that the newest effect does is shift stamps by what jitter does, too."""
    effect = fit.structure.effects[-1]
    return not effect.again and all(
        abs(fit.parameters[p.name]) < SLIGHT.get(p.name, 0.0)
        for p in effect.parameters() if not p.fixed)


def is_eased(fit: Fit) -> bool:
    """Return whether the newest effect lets tyres grip better than before: that is a ground's."""
    effect = fit.structure.effects[-1]
    return effect.again and effect.id == 'traction_saturation' and any(
        fit.parameters[later] > fit.parameters[own] for own, later in effect.renamed.items())


def left_by(observations: Observations, fit: Fit, metric_: Metric) -> float:
    """Return half the sum of squares that a fit leaves, whitened by a metric [nats]."""
    white = metric_.whiten(observations, observations.measured - fit.solution.predicted)
    return 0.5 * float(white @ white)


def rescued(observations: Observations, base: Fit, nominal: Parameters,
            usable: Sequence[tuple[Score, Fit]], metric_: Metric, rebased: Fit,
            workers: Workers) -> list[tuple[Score, Fit]]:
    """
    Refit those that are worse than without their effect under the metric that judges them.

    The metric of the refits gives little weight to what no signature explains along a straight
    line; a candidate whose world is bent there may end where the judging metric looks closely.

    Parameters
    ----------
    observations : Observations
    base : Fit
    nominal : Parameters
    usable : sequence of (Score, Fit)
    metric_ : Metric
        That judges.
    rebased : Fit
        Without any of them.
    workers : Workers

    Returns
    -------
    list of (Score, Fit)
        In the same order.
    """
    without = left_by(observations, rebased, metric_)
    lost = [i for i, (_, fit) in enumerate(usable) if left_by(
        observations, fit, metric_) > without]
    lean = {i: without_columns(usable[i][0]) for i in lost}
    quick = workers.map(run_refit, [Refit(observations, base, nominal, lean[i], metric_, 3)
                                    for i in lost])
    started = [(i, fit) for i, fit in zip(lost, quick, strict=True) if fit is not None]
    again = workers.map(run_refit, [Refit(observations, base, nominal, lean[i], metric_, 6, fit)
                                    for i, fit in started])
    better = {i: fit for (i, _), fit in zip(started, again, strict=True) if fit is not None}
    return [(score, better.get(i, fit)) for i, (score, fit) in enumerate(usable)]


def settled(observations: Observations, base: Fit, nominal: Parameters, rebased: Fit,
            usable: Sequence[tuple[Score, Fit]], metric_: Metric, workers: Workers
            ) -> tuple[Fit, list[tuple[Score, Fit]]]:
    """
    Refit the best under the metric that judges: under another, optima differ by tens of nats.

    Parameters
    ----------
    observations : Observations
    base : Fit
        Of the round.
    nominal : Parameters
    rebased : Fit
        Without any of the candidates.
    usable : sequence of (Score, Fit)
    metric_ : Metric
        That judges.
    workers : Workers

    Returns
    -------
    Fit
        The base.
    list of (Score, Fit)
        In the same order.
    """
    again = fit_structure(observations, base.structure, nominal, metric_,
                          rebased.solution.values, base.parameters, SETTLE)
    left = [left_by(observations, fit, metric_) for _, fit in usable]
    lead = left_by(observations, rebased, metric_) - min(left)
    near = [i for i, one in enumerate(left)
            if one - min(left) < max(CONTEND[0], CONTEND[1] * lead)]
    fits = workers.map(run_refit, [
        Refit(observations, base, nominal, without_columns(score), metric_, SETTLE, fit)
        for score, fit in (usable[i] for i in near)])
    better = {i: fit for i, fit in zip(near, fits, strict=True) if fit is not None}
    return again or rebased, [(score, better.get(i, fit)) for i, (score, fit) in enumerate(usable)]


def screen(observations: Observations, base: Fit, metric_: Metric,
           signatures: Sequence[Signature], masks: Sequence[Onsets]) -> list[Score]:
    """
    Score all signatures under one metric.

    Parameters
    ----------
    observations : Observations
    base : Fit
    metric_ : Metric
    signatures : sequence of Signature
    masks : sequence of Onsets

    Returns
    -------
    list of Score
        Best first.
    """
    unknowns = base.solution.unknowns
    deviations = np.array([u.deviation for u in unknowns])
    pull = np.array([(u.centre - u.varied(base.solution.values[u.name])) / u.deviation
                     for u in unknowns])
    projector = Projector(observations, metric_, observations.measured - base.solution.predicted,
                          base.solution.jacobian, deviations, pull)
    return scan(projector, signatures, masks)
