# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""From a search to an answer: names, numbers, rivals and what cannot be told apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from lg_husky_sim.diagnosis.candidates import candidates
from lg_husky_sim.diagnosis.confidence import estimates, name_confidence, p_value
from lg_husky_sim.diagnosis.doubts import belief, further_gain, reading_gain
from lg_husky_sim.diagnosis.events import energy_in_moments, what_happens
from lg_husky_sim.diagnosis.everyday import most_tried, named_rounds, open_rounds
from lg_husky_sim.diagnosis.evidence import folds_of, held_out_cost
from lg_husky_sim.diagnosis.fits import Fit
from lg_husky_sim.diagnosis.misfit import against_before, beyond_chance, is_far, trust
from lg_husky_sim.diagnosis.regimes import where_it_shows
from lg_husky_sim.diagnosis.result import Estimate, Finding, Indistinguishable, Rivalry, Verdict
from lg_husky_sim.diagnosis.rivals import CHANGE_SHARE, Rival
from lg_husky_sim.diagnosis.rounds import Round
from lg_husky_sim.diagnosis.search import Search
from lg_husky_sim.diagnosis.separation import separated_by
from lg_husky_sim.diagnosis.unnamed import Unnamed
from lg_husky_sim.husky.effects import Effect, LATER, Onset, OnsetKind, Subsystem
from lg_husky_sim.husky.parameters import Parameters
import numpy as np

#: Gain of a signature from which something is missing, if a refit then predicts held-out data so
#: much better [nats].
CERTAIN, FOLLOWED = 60.0, 30.0
#: Held-out gain of an effect from which something is missing [nats]; then of a smooth description,
#: and the share of the unexplained that it must explain then.
EVIDENT, SMOOTH, SMOOTH_SHARE = 85.0, 110.0, 0.05
#: Held-out gain of an effect from which something has changed between recordings, where much else
#: differs a little [nats].
CERTAIN_CHANGE = 250.0
#: Confirmed gain of a smooth description that is enough alone [nats]. A moment must have it: a
#: rough floor turns a robot more than it does anything else.
CONFIRMED = 25.0
#: Held-out gain from which a smooth description is put into the model, and at which something
#: missing is even with nothing, where it is not known [nats].
DESCRIBED = 45.0
#: Held-out gain of a smooth effort that begins with the later recordings from which something has
#: changed [nats], and how much farther from the model than the earlier ones these must be then.
SMOOTH_CHANGE, SMOOTH_FARTHER = 1000.0, 1.6
#: Gain before anything is refitted, beyond what single moments hold, from which something has
#: changed [nats]: signatures of the catalogue explain it then, and none of their refits does.
SCREENED_CHANGE = 500.0
#: Held-out gain at which nothing missing is even with something, and its width [nats]; then of a
#: change between recordings.
SURE = ((20.0, 6.0), (125.0, 30.0))
#: A rival within this share of the winner's held-out gain, or this many nats, is as good.
NEAR_SHARE = 0.06
NEAR_NATS = 10.0
#: Parameter whose sign says to which side an effect acts: positive to the left.
SIDE_OF = {'yaw_pull': 'pull_moment'}


def onset_words(onset: Onset | None) -> str:
    """Return an onset in words, with a leading comma; empty without one."""
    if onset is None:
        return ''
    if onset.kind is OnsetKind.TIME:
        where = f' of {onset.recording}' if onset.recording else ' of each recording'
        return f', from {onset.value:.1f} s{where} on'
    side = 'above' if onset.kind is OnsetKind.PLACE_ABOVE else 'below'
    return f', where x is {side} {onset.value:.2f} m'


def in_words(numbers: Sequence[Estimate]) -> str:
    """Return estimates as text with their intervals."""
    return ', '.join(
        f'{e.name.replace("_", " ")} {e.value:.3g}{"" if e.unit == "1" else " " + e.unit} '
        f'({e.low:.3g} to {e.high:.3g})' for e in numbers)


def side_words(effect: Effect) -> str:
    """Return on which side an effect is, in words."""
    return '' if effect.side in ('none', '') else {
        'both': ' (both sides)', 'left': ' (left side)', 'right': ' (right side)'}[effect.side]


def _acting_side(effect: Effect, numbers: Sequence[Estimate]) -> str:
    # The side of an effect without one, where the sign of a number is a side.
    value = next((e.value for e in numbers if e.name == SIDE_OF.get(effect.id)), 0.0)
    return effect.side if value == 0.0 else 'left' if value > 0.0 else 'right'


def is_near(rival: Rival, best: Rival) -> bool:
    """Return whether a rival explains held-out data about as well as the best."""
    return rival.held_out > best.held_out - max(NEAR_NATS, NEAR_SHARE * best.held_out)


def _is_given(search: Search) -> bool:
    onset, change = search.final.structure.onset, search.change
    return onset is not None and change is not None and (
        onset.kind, onset.recording, onset.value) == (
        change.kind, change.recording, change.value)


def rivals_of(one: Round, named: Effect | None) -> tuple[Rivalry, ...]:
    """Return what else was tried in a round, best first."""
    # Each effect once, by the best of its sides and shapes.
    best: dict[str, Rivalry] = {}
    for r in one.rivals:
        known = best.get(r.effect.id)
        if (named is None or r.effect.id != named.id) and (
                known is None or r.held_out > known.held_out_gain):
            best[r.effect.id] = Rivalry(r.effect.id, r.effect.side, r.held_out)
    return tuple(best.values())


def findings(search: Search) -> tuple[Finding, ...]:
    """
    Return what was adopted and is more than everyday, strongest first.

    Parameters
    ----------
    search : Search

    Returns
    -------
    tuple of Finding
        Numbers and intervals from the joint fit of all of them.
    """
    observations, found = search.observations, []
    hypotheses = len(candidates())
    folds = folds_of(observations)
    for one in named_rounds(search):
        best = one.rivals[0]
        effect = best.effect
        names = [p.name for p in effect.parameters() if not p.fixed]
        final = search.final
        numbers = tuple(replace(e, name=e.name.removesuffix(LATER)) for e in estimates(
            observations, final, one.metric, names))
        gain = held_out_cost(observations, one.base, one.metric, folds) - held_out_cost(
            observations, best.fit, one.metric, folds)
        regime = where_it_shows(observations, gain)
        onset = final.structure.onset if effect.late and not _is_given(search) else None
        changed = 'this has changed: ' if effect.again else ''
        statement = (f'{changed}{effect.kind.title}{side_words(effect)}{onset_words(onset)}: '
                     f'{in_words(numbers)}. It shows {regime} and explains '
                     f'{100.0 * min(max(one.share, 0.0), 1.0):.0f} % of what was unexplained.')
        found.append(Finding(
            effect.id, _acting_side(effect, numbers), effect.kind.subsystem.value,
            effect.kind.elements, regime, onset, numbers,
            best.held_out, p_value(best.gain, len(names), hypotheses), one.share,
            rivals_of(one, effect), statement[0].upper() + statement[1:]))
    return tuple(found)


def indistinguishable(search: Search) -> tuple[Indistinguishable, ...]:
    """
    Return the sets of effects between which the data do not decide.

    Parameters
    ----------
    search : Search

    Returns
    -------
    tuple of Indistinguishable
        A set for each named effect with rivals that explain held-out data about as well.
    """
    found = []
    for one in named_rounds(search):
        best = one.rivals[0]
        near = [r for r in one.rivals[1:] if r.effect.id != best.effect.id and is_near(r, best)]
        if near:
            names = tuple(dict.fromkeys([best.effect.id, *(r.effect.id for r in near)]))
            sensors, manoeuvres = separated_by(names)
            found.append(Indistinguishable(names, sensors, manoeuvres))
    return tuple(found)


def is_unnamed(search: Search, unnamed: Unnamed | None) -> bool:
    """
    Return whether something is missing although nothing could be named.

    Parameters
    ----------
    search : Search
        That named nothing.
    unnamed : Unnamed or None
        What smooth descriptions explain, if it was looked at.

    Returns
    -------
    bool
        Whether an effect that is more than everyday, or a description, explains more than chance,
        however little of it, or the model is so far from the data that something must be missing.
    """
    if is_far(search) or what_happens(search):
        return True
    first = open_rounds(search)[0]
    screened = first.scores[0].gain if first.scores else 0.0
    tried = most_tried(search)
    if search.change is not None:
        return screened > SCREENED_CHANGE + energy_in_moments(search, first) or (
            tried > CERTAIN_CHANGE and first.share > CHANGE_SHARE[1]) or (
            unnamed is not None and unnamed.held_out > SMOOTH_CHANGE
            and unnamed.share > CHANGE_SHARE[1]
            and against_before(search, search.final, True) > beyond_chance(
                search, SMOOTH_FARTHER))
    if tried > EVIDENT or (screened > CERTAIN and tried > FOLLOWED):
        return True
    if unnamed is None or not unnamed.descriptions or unnamed.share <= SMOOTH_SHARE:
        return False
    turns = unnamed.descriptions[0].effect.kind.subsystem is Subsystem.ROTATION
    return unnamed.confirmed > CONFIRMED or (unnamed.held_out > SMOOTH and not turns)


def confidence(search: Search, verdict: Verdict, unnamed: Unnamed | None = None) -> float:
    """
    Return how sure the verdict and the first name are.

    Parameters
    ----------
    search : Search
    verdict : Verdict
    unnamed : Unnamed, optional
        What smooth descriptions explain: they speak for an unknown effect, too.

    Returns
    -------
    float
        Between 0 and 1.
    """
    first = open_rounds(search)[0]
    strongest = max((r.held_out for r in first.rivals), default=0.0)
    if verdict is Verdict.NOTHING_MISSING:
        strongest = most_tried(search)
        half, width = SURE[search.change is not None]
        return float(1.0 / (1.0 + np.exp((strongest - half) / width)))
    if verdict is Verdict.UNKNOWN:
        strongest = max(strongest, 0.0 if unnamed is None else unnamed.held_out)
        far = 1.0 if is_far(search) or what_happens(search) else 0.0
        return float(max(1.0 / (1.0 + np.exp(-(strongest - DESCRIBED) / 15.0)), far) * 0.5 + 0.4)
    by_name: dict[str, float] = {}
    for rival in first.rivals:
        by_name[rival.effect.id] = max(by_name.get(rival.effect.id, -np.inf), rival.held_out)
    gains = sorted(by_name.values(), reverse=True)
    remaining = max(reading_gain(search.observations, search.final), further_gain(search))
    return name_confidence(gains) * belief(strongest, first.share, remaining) * trust(search)


def recalibration(search: Search, fit: Fit, nominal: Parameters) -> tuple[Estimate, ...]:
    """Return the nominal parameters as the reported fit has them, with intervals."""
    names = [u.name for u in fit.solution.unknowns if not u.extra and u.name in nominal]
    return estimates(search.observations, fit, search.rounds[-1].metric, names)


def moved(numbers: Sequence[Estimate], nominal: Mapping[str, float]) -> tuple[Estimate, ...]:
    """Return those whose interval leaves the nominal value out by more than a twentieth."""
    return tuple(e for e in numbers if not e.low <= nominal[e.name] <= e.high
                 and abs(e.value - nominal[e.name]) > 0.05 * abs(nominal[e.name]))
