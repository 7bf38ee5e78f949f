# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Which one change is named, how surely, and what it cannot be told from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math

from lg_husky_sim.diagnosis.before_after.comparison import Block, Candidate
from lg_husky_sim.diagnosis.before_after.judge import is_beyond_chance
from lg_husky_sim.diagnosis.before_after.settings import Change, Settings


@dataclass(frozen=True, eq=False)
class Decision:
    """
    What is said of one change.

    Parameters
    ----------
    named : Candidate or None
        None where nothing changed.
    rivals : tuple of Candidate
        The best of every other name, by gain.
    tied : tuple of str
        Names that cannot be told from the one given, itself first; empty where it stands alone.
    confidence : float
        How likely it is right, by a logistic function of what informs about it::

            p = 1 / (1 + exp(-(c0 + c1 log10(chance))))

        The margin to the next name is not used: where it is small, the names are tied.
    unknown : float
        Gain of letting everything differ where something changed that has no name [nats]; else 0.
    chance : float
        Of what is claimed, or gains most where nothing is, on a robot that has not changed.

    """

    named: Candidate | None
    rivals: tuple[Candidate, ...]
    tied: tuple[str, ...]
    confidence: float
    unknown: float = 0.0
    chance: float = 1.0

    @property
    def features(self) -> dict[str, float]:
        """Return what the confidence is made of."""
        return {'gain': self.gain, 'chance': self.chance}

    @property
    def gain(self) -> float:
        """Of what is claimed [nats]; 0 where nothing is."""
        return self.unknown if self.named is None else self.named.gain


def named_by(body: Sequence[Candidate], whole: Sequence[Candidate],
             numbers: Mapping[str, float]) -> Candidate | None:
    """
    Return the change that is claimed, if any.

    The motion of the body at the measured wheel rates decides first: a change of the loop leaves
    it alone. Only a change of the loop that gains many times as much overrules it. Where the body
    says nothing, all channels decide.

    Parameters
    ----------
    body, whole : sequence of Candidate
        As the motion of the body, and as all channels see them; by gain, the largest first.
    numbers : mapping of str to float
        ``decision`` of the settings.

    Returns
    -------
    Candidate or None

    """
    first, other = _settled(body, whole, numbers), _simplest(whole, numbers)
    if first is None or not is_beyond_chance(first, numbers):
        return other if other is not None and is_beyond_chance(other, numbers) else None
    loop = _simplest([one for one in whole if one.change.block == 'loop'], numbers)
    if loop is None or not is_beyond_chance(loop, numbers):
        return first
    as_well = max((one.gain for one in whole if one.change is first.change), default=0.0)
    return first if loop.gain < max(numbers['loop_share'] * first.gain, as_well) else loop


def _settled(body: Sequence[Candidate], whole: Sequence[Candidate], numbers: Mapping[str, float]
             ) -> Candidate | None:
    # Names that gain as much in the body's motion, by what they gain in all channels.
    near = [one for one in body if body[0].gain - one.gain < numbers['tie']
            and is_beyond_chance(one, numbers)]
    if len(near) < 2:
        return _simplest(body, numbers)
    changes = [one.change for one in near]
    better = _simplest([one for one in whole if one.change in changes], numbers)
    return next((one for one in near if better is not None and one.change == better.change),
                near[0])


def _simplest(candidates: Sequence[Candidate], numbers: Mapping[str, float]) -> Candidate | None:
    # Of a hypothesis and a part of it, the part, unless the rest gains beyond chance by itself.
    if not candidates:
        return None
    best, least = candidates[0], -math.log(numbers['false_alarm_rate'])
    equal = [one for one in candidates if best.gain - one.gain < least
             and is_beyond_chance(one, numbers)
             and set(one.change.parameters) < set(best.change.parameters)]
    return min(equal, key=lambda one: len(one.change.parameters), default=best)


def decide(body: Block | None, loop: Block, settings: Settings) -> Decision:
    """
    Decide from what both blocks say which change is claimed, if any.

    Parameters
    ----------
    body : Block or None
        None where the recordings lack what it takes.
    loop : Block
        What the fits by the commands say of every change.
    settings : Settings
        Odds and limits of the decision.

    Returns
    -------
    Decision

    """
    numbers = _shared(body, settings)
    bodily = () if body is None else body.candidates
    named = named_by(bodily, loop.candidates, numbers)
    if named is not None:
        return _claimed(named, bodily if named in bodily else loop.candidates, settings, numbers)
    everything = sorted((*bodily, *loop.candidates), key=lambda one: -one.gain)
    least = min((one.chance for one in everything if one.gain > 0.0), default=1.0)
    return Decision(None, _best_of_names(everything, ''), (),
                    _likely('unchanged', least, numbers), chance=least)


def claim(change: Change, body: Block | None, loop: Block, settings: Settings) -> Decision | None:
    """Return the claim of a certain change, if one of the blocks makes it beyond chance."""
    numbers = _shared(body, settings)
    for block in (body, loop):
        candidates = () if block is None else block.candidates
        for one in candidates:
            if one.change == change and is_beyond_chance(one, numbers):
                return _claimed(one, candidates, settings, numbers)
    return None


def foremost(body: Block | None, loop: Block, settings: Settings) -> Decision | None:
    """
    Return the change that makes up most of a difference beyond chance, if there is one.

    Few recordings can be parted in few ways, and then no single gain is beyond chance, while the
    difference of everything is. Which name it has is a question of evidence then, not of chance.

    Parameters
    ----------
    body : Block or None
        What the fits at the measured wheel rates say; None without what they take.
    loop : Block
        What the fits by the commands say of every change.
    settings : Settings
        Odds and limits of the decision.

    Returns
    -------
    Decision or None
        None where there is no difference beyond chance, or no name explains more of it than it
        leaves, and more than any other name.

    """
    numbers = _shared(body, settings)
    surest = _differing(body, loop, numbers)
    if surest is None or not surest.candidates:
        return None
    first = surest.candidates[0]
    others = _best_of_names(surest.candidates, first.change.effect)
    if first.gain < numbers['foremost_share'] * surest.anything or any(
            first.gain - one.gain < numbers['tie'] for one in others):
        return None
    return _claimed(first, surest.candidates, settings, numbers)


def unnamed(body: Block | None, loop: Block, explained: float, settings: Settings
            ) -> Decision | None:
    """
    Return that something changed which has no name, if that is so.

    Parameters
    ----------
    body : Block or None
        What the fits at the measured wheel rates say; None without what they take.
    loop : Block
        What the fits by the commands say of every change.
    explained : float
        What the claimed changes gain together [nats]; 0 where none is.
    settings : Settings
        Odds and limits of the decision.

    Returns
    -------
    Decision or None
        None where there is no difference beyond chance, or what is claimed explains enough of it.

    """
    numbers = _shared(body, settings)
    surest = _differing(body, loop, numbers)
    if surest is None or explained >= numbers['unknown_share'] * surest.anything:
        return None
    everything = sorted((one for block in (body, loop) if block is not None
                         for one in block.candidates), key=lambda one: -one.gain)
    return Decision(None, _best_of_names(everything, ''), (),
                    _likely('change', surest.chance, numbers), surest.anything, surest.chance)


def _differing(body: Block | None, loop: Block, numbers: Mapping[str, float]) -> Block | None:
    # The block whose difference of everything is the surest, if it is beyond chance.
    surest = min((block for block in (body, loop) if block is not None),
                 key=lambda block: block.chance if block.anything > 0.0 else 1.0)
    differs = surest.anything > 0.0 and surest.chance < numbers['false_alarm_rate']
    return surest if differs else None


def _shared(body: Block | None, settings: Settings) -> dict[str, float]:
    # The accepted rate is that of all blocks looked at together (Bonferroni).
    rate = settings.decision['false_alarm_rate'] / (1 if body is None else 2)
    return {**settings.decision, 'false_alarm_rate': rate}


def _claimed(named: Candidate, block: Sequence[Candidate], settings: Settings,
             numbers: Mapping[str, float]) -> Decision:
    rivals = _best_of_names(block, named.change.effect)
    alike = [one.change.effect for one in rivals if is_beyond_chance(one, numbers) and (
        named.gain - one.gain < max(numbers['tie'], numbers['near'] * named.gain))]
    alike += settings.aliases.get(named.change.effect, ())
    tied = (named.change.effect, *dict.fromkeys(alike)) if alike else ()
    return Decision(named, rivals, tied, _likely('change', named.chance, numbers),
                    chance=named.chance)


def _best_of_names(candidates: Sequence[Candidate], but: str) -> tuple[Candidate, ...]:
    found: dict[str, Candidate] = {}
    for one in candidates:
        if one.change.effect != but:
            found.setdefault(one.change.effect, one)
    return tuple(found.values())


def _likely(answer: str, chance: float, numbers: Mapping[str, float]) -> float:
    # What is less than the least chance is told apart by nobody.
    odds = numbers[f'{answer}_constant'] + numbers[f'{answer}_chance'] * math.log10(
        max(chance, numbers['least_chance']))
    return 1.0 / (1.0 + math.exp(-odds))
