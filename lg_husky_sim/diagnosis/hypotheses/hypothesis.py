# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A hypothesis: an effect of the catalogue on a side, in a variant, from an onset on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
import itertools

from lg_husky_sim.diagnosis.evidence.point import Point
from lg_husky_sim.diagnosis.evidence.unknowns import effect_unknowns, NEUTRAL
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.effects import catalogue, Effect, EffectParameter, Onset
from lg_husky_sim.husky.model import Structure
from lg_husky_sim.husky.parameters import Parameter
import numpy as np

Numbers = Mapping[str, float]


@dataclass(frozen=True)
class Hypothesis:
    """
    One effect, with the sizes from which its search begins.

    Parameters
    ----------
    effect : Effect
    starts : tuple of mapping
        Values of its free parameters.
    onset : Onset or None

    """

    effect: Effect
    starts: tuple[Numbers, ...]
    onset: Onset | None = None

    @property
    def label(self) -> str:
        """Short name: id, side, shape, onset."""
        parts = [self.effect.id]
        parts += [p for p in (self.effect.side, self.effect.shape) if p not in ('', 'none')]
        late = '' if self.onset is None else (
            f'@{self.onset.kind.value}:{self.onset.recording}:{self.onset.value:.2f}')
        return ':'.join(parts) + late

    @property
    def size(self) -> int:
        """Numbers that it costs: those of the effect, and one for an onset."""
        return len(self.free) + (self.onset is not None)

    @property
    def free(self) -> tuple[EffectParameter, ...]:
        """Estimated parameters of the effect."""
        return tuple(p for p in self.effect.parameters() if not p.fixed)

    @property
    def family(self) -> tuple[str, str, str]:
        """Id, side, and the form that its own is or is stood for by."""
        effect = self.effect
        return effect.id, effect.side, next(
            (shape for shape, others in effect.kind.stands_for.items() if effect.shape in others),
            effect.shape)

    @property
    def others(self) -> tuple[Hypothesis, ...]:
        """Return the other forms of its family."""
        found, first = [], self.family[-1]
        for shape in (first, *self.effect.kind.stands_for.get(first, ())):
            effect = replace(self.effect, shape=shape)
            if shape != self.effect.shape:
                found.append(replace(_of(effect), onset=self.onset))
        return tuple(found)

    @property
    def other_sides(self) -> tuple[Hypothesis, ...]:
        """Return the same on every other side that it can be on."""
        return tuple(replace(_of(replace(self.effect, side=side)), onset=self.onset)
                     for side in self.effect.kind.sides if side != self.effect.side)

    def at(self, onset: Onset | None) -> Hypothesis:
        """Return this effect with another onset."""
        return replace(self, effect=replace(self.effect, late=onset is not None), onset=onset)

    def apply(self, structure: Structure) -> Structure:
        """Return a structure with this effect in it."""
        return structure.with_effect(self.effect, self.onset)

    def point(self, base: Point, numbers: Numbers) -> Point:
        """Return a point with this effect's numbers as further unknowns."""
        unknowns = effect_unknowns(self.effect, numbers)
        entries = entries_of(self.effect, numbers)
        places = np.concatenate([base.places, [u.place(numbers[u.name]) for u in unknowns]])
        return Point(self.apply(base.structure), (*base.unknowns, *unknowns), places,
                     base.parameters.with_entries(*entries), base.reading)

    def trials(self) -> list[list[Numbers]]:
        """
        Return what to simulate for a first look.

        Returns
        -------
        list of list of mapping
            Groups; the columns of a group are looked at together. Numbers that do something by
            themselves get a column each.

        """
        known = [neutral_of(p) for p in self.free]
        neutral = {p.name: v for p, v in zip(self.free, known, strict=True) if v is not None}
        separable = len(self.free) > 1 and len(neutral) == len(self.free)
        groups: list[list[Numbers]] = []
        for start in self.starts:
            if separable or (len(self.free) == 1 and proportional(self.free[0])):
                groups.append([{**neutral, p.name: _tried(p, start)}
                               for p in self.free])
            else:
                groups.append([start])
        return groups


def proportional(parameter: EffectParameter) -> bool:
    """Return whether small sizes of a number act in proportion: it has either sign, or says so."""
    neutral = neutral_of(parameter)
    return neutral is not None and (
        parameter.linear or parameter.lower < neutral < parameter.upper)


def _tried(parameter: EffectParameter, start: Numbers) -> float:
    # A small step where numbers act in proportion: what remains of a large one when the numbers
    # of the base have moved would be its curvature.
    if not proportional(parameter):
        return start[parameter.name]
    neutral = neutral_of(parameter) or 0.0
    return neutral + setting('small_step') * (start[parameter.name] - neutral)


def neutral_of(parameter: EffectParameter) -> float | None:
    """Return the value at which a number does nothing by itself; None where there is none."""
    if parameter.name in NEUTRAL:
        return NEUTRAL[parameter.name]
    if parameter.name.startswith(('slew_', 'limit_')):
        return parameter.upper
    return 0.0 if parameter.lower <= 0.0 <= parameter.upper else None


def negligible(hypothesis: Hypothesis, values: Numbers, jitter: Mapping[str, float] | None = None
               ) -> bool:
    """
    Return whether every number of an effect is too small, or too large, to count.

    Parameters
    ----------
    hypothesis : Hypothesis
        Whose shape says which stream may make as much.
    values : mapping
        Of all its free numbers.
    jitter : mapping of str to float, optional
        Of the streams of a log [s], which may make as much of a delay; none if not given.

    """
    shape = hypothesis.effect.shape

    def least(parameter: EffectParameter) -> float:
        of = parameter.jitter.get(shape)
        return max(parameter.negligible, setting('late_by_jitter') * jitter[of] if of and jitter
                   else 0.0)
    return all(values[p.name] >= p.none_from
               or abs(values[p.name] - (neutral_of(p) or 0.0)) < least(p)
               for p in hypothesis.free)


def entries_of(effect: Effect, numbers: Numbers) -> tuple[Parameter, ...]:
    """Return all parameters of an effect at given values, inside their bounds."""
    return tuple(
        p.parameter(min(max(numbers[p.name], p.lower), p.upper) if p.name in numbers else None)
        for p in effect.parameters())


def hypotheses(structure: Structure) -> tuple[Hypothesis, ...]:
    """
    Return the catalogue as hypotheses: one for each side and shape that a structure can take.

    Parameters
    ----------
    structure : Structure
        Robot with the effects that it has already.

    Returns
    -------
    tuple of Hypothesis
        Without effects that it has, without those that share a number with one it has, and
        without those of the catalogue that a diagnosis does not try, and without forms that
        another one stands for.

    """
    taken = {p.name for e in structure.effects for p in e.parameters()}
    found = []
    for name, kind in ((name, kind) for name, kind in catalogue().items() if kind.tried):
        later = {shape for others in kind.stands_for.values() for shape in others}
        for side, shape in itertools.product(kind.sides, kind.shapes):
            effect = Effect(name, side, shape, robot=structure.robot)
            if not taken & {p.name for p in effect.parameters()} and shape not in later:
                found.append(_of(effect))
    return tuple(found)


def _of(effect: Effect) -> Hypothesis:
    free = [p for p in effect.parameters() if not p.fixed]
    return Hypothesis(effect, tuple(
        {p.name: p.starts[min(i, len(p.starts) - 1)] for p in free}
        for i in range(max(len(p.starts) for p in free))))


def with_effects(plain: Point, final: Point, kept: Sequence[Hypothesis]) -> Point:
    """
    Return a fitted point with some of its effects only, read as it is.

    Parameters
    ----------
    plain : Point
        The model without effects but those of faults that are certain, which stay.
    final : Point
        Fitted with all effects; its reading stays.
    kept : sequence of Hypothesis
        Their numbers come last.

    Returns
    -------
    Point

    """
    own = {unknown.name for unknown in plain.unknowns}
    base = [place for place, unknown in enumerate(final.unknowns)
            if unknown.kind != 'effect' or unknown.name in own]
    point = replace(plain, reading=final.reading, places=np.array(final.places[base]),
                    unknowns=tuple(final.unknowns[place] for place in base))
    return having(point, final, kept)


def having(point: Point, final: Point, kept: Sequence[Hypothesis]) -> Point:
    """Return a point with effects as they were fitted, all else as it is."""
    for one in kept:
        point = one.point(point, {p.name: final.values[p.name] for p in one.free})
    return point


def labels(found: Sequence[Hypothesis]) -> list[str]:
    """Return the short names of hypotheses."""
    return [h.label for h in found]
