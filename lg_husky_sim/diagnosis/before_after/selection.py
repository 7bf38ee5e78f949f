# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Several changes at once: adopted one after another, dropped where others make up for them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from lg_husky_sim.diagnosis.before_after.comparison import Block, Candidate
from lg_husky_sim.diagnosis.before_after.decision import claim, decide, Decision, foremost, unnamed
from lg_husky_sim.diagnosis.before_after.settings import Change, Settings

#: What both blocks say (of the body only where the recordings have what it takes) where some
#: changes are adopted; and the changes with which the recordings are fitted for that.
Compared = Callable[[tuple[Change, ...], tuple[Change, ...]], tuple[Block | None, Block]]


@dataclass(frozen=True, eq=False)
class Selection:
    """
    What changed.

    Parameters
    ----------
    decisions : tuple of Decision
        One a change, each with the others adopted, the largest gain first; a single one without
        a name where nothing changed, or nothing that has one.
    body, loop : Block or None
        What both blocks say where nothing is adopted, fitted with what gains most.
    claimed : Block
        What all channels say where the changes that are named are.

    """

    decisions: tuple[Decision, ...]
    body: Block | None
    loop: Block
    claimed: Block


def select(compared: Compared, settings: Settings) -> Selection:
    """
    Adopt one change after another, then drop those that the others make up for.

    Of what the recordings are not fitted with, a derivative where the robot has none of it gives
    a poor idea. Where such a change gains most, the later recordings are fitted with it before
    anything is decided.

    Every further change is weighed where those before it differ as well, by the same evidence and
    against the same partitions. So the rate of false alarms is that of the first that is too many.

    Parameters
    ----------
    compared : callable
        Gives both blocks from what is adopted and what the later recordings are fitted with.
    settings : Settings
        Odds and limits of the decision, and how many changes are adopted at most.

    Returns
    -------
    Selection

    """
    body, loop = compared((), ())
    body, loop = compared((), _bringing([
        block.candidates[0].change for block in (body, loop)
        if block is not None and block.candidates and block.candidates[0].gain > 0.0], settings))
    adopted: list[Change] = []
    first = decide(body, loop, settings)
    if first.named is None:
        first = foremost(body, loop, settings) or first
    decisions: tuple[Decision, ...] = (first,)
    latest = first.named
    while latest is not None and latest.change not in adopted:
        adopted.append(latest.change)
        if len(adopted) == int(settings.decision['changes_at_once']):
            break
        latest = _further(compared, adopted, decisions[0].gain, settings)
    if adopted:
        decisions = _needed(adopted, compared, settings) or decisions
    claimed = tuple(one.named.change for one in decisions if one.named is not None)
    with_them = compared(claimed, _bringing(claimed, settings))
    explained = max(block.explained for block in with_them if block is not None)
    other = unnamed(body, loop, explained, settings)
    if other is not None:
        return Selection((other,), body, loop, loop)
    return Selection(decisions, body, loop, with_them[1])


def _further(compared: Compared, adopted: Sequence[Change], first: float, settings: Settings
             ) -> Candidate | None:
    # What moves the body is told by the body's own block, if there is one: the loop's model takes
    # it for what it leaves out. So does the law of a change, by a share of what that gains.
    body, loop = compared(tuple(adopted), _bringing(adopted, settings))
    if body is not None:
        loop = replace(loop, candidates=tuple(
            one for one in loop.candidates if one.change.block == 'loop'))
    named = decide(body, loop, settings).named
    if named is None or named.gain < settings.decision['further_share'] * first:
        return None
    return named


def _bringing(changes: Sequence[Change], settings: Settings) -> tuple[Change, ...]:
    # Those of what a nominal robot has not, with which recordings are to be fitted again.
    return tuple(one for one in changes if set(one.parameters) & set(settings.runs_as))


def _needed(adopted: Sequence[Change], compared: Compared, settings: Settings
            ) -> tuple[Decision, ...]:
    # Backward elimination: what is not beyond chance beside the others goes, the last first.
    kept = list(adopted)
    while kept:
        claims = [claim(change, *compared(tuple(one for one in kept if one is not change),
                                          _bringing(kept, settings)), settings)
                  for change in kept]
        needless = [change for change, one in zip(kept, claims, strict=True) if one is None]
        if not needless:
            return tuple(sorted((one for one in claims if one is not None),
                                key=lambda one: -one.gain))
        kept.remove(needless[-1])
    return ()


def remembered(compared: Compared) -> Compared:
    """Return a comparison that is made once for each set of changes."""
    known: dict[tuple[frozenset[Change], frozenset[Change]], tuple[Block | None, Block]] = {}

    def once(adopted: tuple[Change, ...], fitted: tuple[Change, ...]
             ) -> tuple[Block | None, Block]:
        key = frozenset(adopted), frozenset(fitted)
        if key not in known:
            known[key] = compared(adopted, fitted)
        return known[key]
    return once
