# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The side of an effect, chosen again as the log is read in the end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
import itertools

from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.evidence.point import Point
from lg_husky_sim.diagnosis.hypotheses.hypothesis import Hypothesis, with_effects
from lg_husky_sim.diagnosis.selection.rounds import attempt, Round
from lg_husky_sim.errors import LgHuskyError


def on_likelier_sides(evidence: Evidence, plain: Point, final: Fit, rounds: Sequence[Round],
                      found: Sequence[Hypothesis]) -> tuple[Fit, list[Round], list[Hypothesis]]:
    """
    Move effects to the other side where that makes the log likelier.

    A side was chosen under the noise and the reading of its round; what was found afterwards, or
    how the log is read by then, may tell the sides apart better.

    Parameters
    ----------
    evidence : Evidence
    plain : Point
        The model without effects.
    final : Fit
        With all of them.
    rounds : sequence of Round
        Those that adopted them first.
    found : sequence of Hypothesis

    Returns
    -------
    Fit
    list of Round
    list of Hypothesis
        Both in the same order.
    """
    kept, told = list(found), list(rounds)
    for place, one in enumerate(found):
        if not one.other_sides:
            continue
        rest = with_effects(plain, final.point, [h for h in kept if h is not one])
        try:
            base = evidence.fit(rest)
        except LgHuskyError:
            # The others do not go without it.
            continue
        for other in one.other_sides:
            tried = attempt(evidence, base, other, list(itertools.product(
                [base.point, rest], other.starts)))
            if tried is not None and tried.fit.cost < final.cost:
                final, kept[place], told[place] = tried.fit, other, _first(told[place], other)
    return final, told, kept


def _first(one: Round, other: Hypothesis) -> Round:
    # With what was tried of that side as the best, or else what was adopted as if it were.
    best = next((t for t in one.tried if t.hypothesis.effect == other.effect),
                replace(one.tried[0], hypothesis=other))
    return replace(one, tried=(best, *(t for t in one.tried if t is not best)))
