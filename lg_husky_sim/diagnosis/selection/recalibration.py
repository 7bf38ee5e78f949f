# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The model as it is, fitted from where it should be, with how its log was made and its ticks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
import math

from lg_husky_sim.diagnosis.evidence.drives import Drive
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.evidence.point import Point
from lg_husky_sim.diagnosis.evidence.stamps import likeliest_stamps
from lg_husky_sim.diagnosis.hypotheses.hypothesis import hypotheses, Hypothesis
from lg_husky_sim.diagnosis.selection.conventions import best_reading, read_like
from lg_husky_sim.diagnosis.selection.nominal import is_distorted, nominal_of
from lg_husky_sim.diagnosis.selection.onsets import onset_looks
from lg_husky_sim.diagnosis.selection.rotors import other_rotors, with_rotors_of
from lg_husky_sim.diagnosis.selection.rounds import calibrated, fitted
from lg_husky_sim.diagnosis.selection.screening import Look, look
from lg_husky_sim.diagnosis.selection.ticks import likelier_ticks, ticked
from lg_husky_sim.diagnosis.selection.tried import Tried
from lg_husky_sim.diagnosis.settings import setting


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


def as_logged(evidence: Evidence, base: Fit, afresh: bool = False) -> Logged:
    """
    Return a base with the likeliest reading or rotors, unless an effect promises more than that.

    A slow sensor and a slow robot are alike; of as many numbers as each has estimated, half the
    logarithm of the number of readings is the price of one.
    """
    chosen = best_reading(evidence, base, afresh)
    heavier = other_rotors(evidence, base)
    if heavier is not None:
        more = 1 + len(base.point.unknowns) - len(chosen.point.unknowns)
        if heavier.cost + 0.5 * more * math.log(evidence.count) < chosen.cost:
            chosen = heavier
    if chosen is base:
        return Logged(base)
    pool = [h for h in hypotheses(base.point.structure) if not h.effect.kind.needs_onset]
    early = fitted(evidence, base, promising(evidence, base, pool), [base.point], whole=False,
                   leading_on=True)
    better = [t for t in early if t.gain > promised(base, chosen)]
    return Logged(base if better else chosen, better, early)


def promising(evidence: Evidence, base: Fit, pool: Sequence[Hypothesis]) -> list[Look]:
    """Return the looks at the effects that promise most, each in its best form."""
    best: dict[str, Look] = {}
    for one in look(evidence, base, pool):
        best.setdefault(one.hypothesis.effect.id, one)
    return list(best.values())[:int(setting('early_effects'))]


def promised(base: Fit, chosen: Fit) -> float:
    """Return what an effect has to gain for another reading to wait."""
    return (1.0 + setting('near_margin')) * (base.cost - chosen.cost)


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
    logged = as_logged(evidence, rough, afresh=True)
    start = nominal_of(logged.fit.point)
    return Recalibrated(evidence, rough, logged, *calibrated(evidence.about(start), start))


def at_ticks(known: Recalibrated, start: Point, rivals: Sequence[Sequence[Drive]]
             ) -> Recalibrated | None:
    """
    Return the same of a base that applies commands at its own ticks, if that is likelier.

    Parameters
    ----------
    known : Recalibrated
        With commands that are applied as they come.
    start : Point
        The nominal model, with the effects that were found. Where its wheels turned out to have
        any inertia, they have here.
    rivals : sequence of sequence of Drive
        With commands at ticks of one rate or another.

    Returns
    -------
    Recalibrated or None
        None where ticks are not likelier, also than commands that are late from some onset on, or
        the robot's numbers are distorted with them, too: it lacks something else then, which the
        ticks may be a part of.

    """
    start = with_rotors_of(start, known.base.point)
    # From where delays have not taken their place, of a log that was made as most are or like that
    # without ticks: a low pass is not to be held against them.
    starts = [start, read_like(start, known.base.point)]
    drives = likelier_ticks(known.first, (known.evidence, known.base), starts[
        :1 if known.base.point.reading == start.reading else 2], rivals)
    if drives is None:
        return None
    other = recalibrated(*ticked(known.first, start, drives))
    if is_distorted(other.base):
        return None
    rival = late_from_an_onset(known.evidence, known.base)
    return None if rival is not None and rival < other.evidence.surprise(other.base) else other


def late_from_an_onset(evidence: Evidence, base: Fit) -> float | None:
    """
    Return the surprise if commands are late from some onset on, and its numbers' price.

    Some commands act later than others then, which slow ticks can mimic.

    Parameters
    ----------
    evidence : Evidence
        With single commands that seem to have been late.
    base : Fit
        With commands that are applied as they come.

    Returns
    -------
    float or None
        [nats]. None where there is no such effect, or it gains nothing.

    """
    pool = [one for one in hypotheses(base.point.structure) if any(
        'command_delay' in p.delays.values() for p in one.effect.parameters())]
    # Those that seemed to be late one by one may be what it is all about.
    evidence = Evidence([replace(d, commands=d.logged) for d in evidence.drives], evidence.names,
                        evidence.noise, evidence.whiteners, evidence.pool)
    base = evidence.fit(base.point)
    tried = fitted(evidence, base, onset_looks(evidence, base, pool, []), [base.point])
    if not tried:
        return None
    own, fit = calibrated(evidence, tried[0].fit.point)
    return own.surprise(fit) + tried[0].gain - tried[0].score
