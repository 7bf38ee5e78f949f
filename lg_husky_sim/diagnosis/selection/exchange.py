# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Effects chosen again beside the others and as the log is read in the end.

Each gives its place to its other sides and to its rivals of the round that adopted it, beside all
others, as exchanges in stepwise regression do: the best first step need not be among the best two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
import itertools
import math

from lg_husky_sim.diagnosis.evidence.dispersion import accident
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.evidence.point import Point
from lg_husky_sim.diagnosis.hypotheses.hypothesis import Hypothesis, Numbers, with_effects
from lg_husky_sim.diagnosis.selection.rounds import attempt, Round
from lg_husky_sim.diagnosis.selection.tried import is_negligible, numbers_of
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.errors import LgHuskyError


def exchanged(evidence: Evidence, plain: Point, final: Fit, rounds: Sequence[Round],
              found: Sequence[Hypothesis]) -> tuple[Fit, list[Round], list[Hypothesis]]:
    """
    Exchange effects for others that make the log likelier.

    An effect was chosen under the noise and the reading of its round; what was found afterwards,
    or how the log is read by then, may tell it better from its rivals, or from itself without its
    onset.

    Parameters
    ----------
    evidence : Evidence
        Drives, and the noise under which fits are made.
    plain : Point
        The model without effects.
    final : Fit
        With all of them.
    rounds : sequence of Round
        Those that adopted them first.
    found : sequence of Hypothesis
        In the order of their rounds.

    Returns
    -------
    Fit
    list of Round
    list of Hypothesis
        Both in the same order.

    """
    kept, told = list(found), list(rounds)
    for place, one in enumerate(found):
        rest = with_effects(plain, final.point, [h for h in kept if h is not one])
        others = [*((other, list(other.starts)) for other in one.other_sides),
                  *_from_the_start(one, final), *_rivals(told[place], one, rest)]
        if not others:
            continue
        try:
            base = evidence.fit(rest)
        except LgHuskyError:
            # The others do not go without it.
            continue
        least, chosen = final.cost + _price(evidence, base, final, one), one
        for other, starts in others:
            tried = attempt(evidence, base, other, list(itertools.product(
                [base.point, rest], starts)))
            if tried is None or is_negligible(tried, evidence.noise.values):
                continue
            price = tried.fit.cost + _price(evidence, base, tried.fit, other)
            if price < least:
                final, least, chosen = tried.fit, price, other
        if chosen is not one:
            kept[place], told[place] = chosen, _first(told[place], chosen)
    return final, told, kept


def _price(evidence: Evidence, base: Fit, fit: Fit, one: Hypothesis) -> float:
    # Of its numbers, and what it gains by an accident [nats].
    return 0.5 * one.size * math.log(evidence.count) + accident(
        evidence, base.whitened, fit.whitened)


def _from_the_start(one: Hypothesis, final: Fit) -> list[tuple[Hypothesis, list[Numbers]]]:
    # One that begins somewhere, if it acts always, from the numbers that it has.
    if one.onset is None or one.effect.kind.needs_onset:
        return []
    values = final.point.values
    return [(one.at(None), [{p.name: values[p.name] for p in one.free}])]


def _rivals(one: Round, adopted: Hypothesis, rest: Point
            ) -> list[tuple[Hypothesis, list[Numbers]]]:
    # The next best of its round that share no number with the others; a model has one onset.
    taken = {p.name for e in rest.structure.effects for p in e.parameters()}
    rivals = [t for t in one.tried if t.hypothesis.effect.id != adopted.effect.id and t.score > 0.0
              and not taken & {p.name for p in t.hypothesis.effect.parameters()}
              and (t.hypothesis.onset is None or rest.structure.onset is None)]
    return [(t.hypothesis, [numbers_of(t), *t.hypothesis.starts])
            for t in rivals[:int(setting('exchanged'))]]


def _first(one: Round, other: Hypothesis) -> Round:
    # With what was tried of that effect as the best, or else what was adopted as if it were.
    best = next((t for t in one.tried if t.hypothesis.effect == other.effect),
                replace(one.tried[0], hypothesis=other))
    return replace(one, tried=(best, *(t for t in one.tried if t is not best)))
