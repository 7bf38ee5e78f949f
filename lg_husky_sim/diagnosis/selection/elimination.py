# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Backward elimination: what was adopted first may not be needed beside what came after it."""

from __future__ import annotations

from collections.abc import Sequence

from lg_husky_sim.diagnosis.decision.adoption import chance_of, is_beyond_chance, is_rather_real
from lg_husky_sim.diagnosis.decision.strain import relieves
from lg_husky_sim.diagnosis.evidence.dispersion import dispersion
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.evidence.point import Point
from lg_husky_sim.diagnosis.hypotheses.hypothesis import hypotheses, Hypothesis, with_effects
from lg_husky_sim.diagnosis.selection.conventions import as_late
from lg_husky_sim.diagnosis.selection.laws import Laws
from lg_husky_sim.errors import LgHuskyError


def eliminated(evidence: Evidence, plain: Point, final: Fit, found: Sequence[Hypothesis]
               ) -> tuple[Fit, list[Hypothesis]]:
    """
    Drop adopted effects without which the others explain as much, as the log is read now.

    Parameters
    ----------
    evidence : Evidence
        Drives, and the noise under which fits are made.
    plain : Point
        The model without effects.
    final : Fit
        With all of them.
    found : sequence of Hypothesis
        In the order of adoption.

    Returns
    -------
    Fit
        With those that are kept.
    list of Hypothesis

    """
    kept = list(found)
    every = sum(len(one.trials()) for one in hypotheses(plain.structure))
    while kept:
        tried = []
        for one in kept:
            try:
                fit = _without(evidence, plain, final.point, one, kept)
            except LgHuskyError:
                # The others do not go without it.
                continue
            tried.append((fit.cost - final.cost, fit, one))
        if not tried:
            break
        loss, fit, one = min(tried, key=lambda t: t[0])
        own = [place for place, unknown in enumerate(final.point.unknowns)
               if unknown.name in {p.name for p in one.free}]
        # One of several is weighed beside the others; the last one was chosen among all.
        others = Laws(plain, [h for h in kept if h is not one])
        left, = others.gains_left(evidence, fit, [final], [loss])
        chance = chance_of(left, one, 1 if len(kept) > 1 else every, evidence, dispersion(
            evidence, final.whitened, final.jacobian[:, own]))
        if is_beyond_chance(chance) and (is_rather_real(
                loss, evidence.count, one.effect) or relieves(fit, final)):
            break
        final = fit
        kept = [h for h in kept if h is not one]
    return final, kept


def _without(evidence: Evidence, plain: Point, final: Point, one: Hypothesis,
             kept: Sequence[Hypothesis]) -> Fit:
    # Where the effect is a delay of a stream, the stamps may stand elsewhere in its windows.
    point = with_effects(plain, final, [h for h in kept if h is not one])
    points = [point, *(other for p in one.free if p.name in final.delays
                       for other in as_late(evidence, point, final.delays[p.name],
                                            final.values[p.name]))]
    return min(map(evidence.fit, points), key=lambda fit: fit.cost)
