# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What may be missing, as edits to try, and what a recalibration may move."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
import itertools
import math

from lg_husky_sim.husky.effects import catalogue, Effect
from lg_husky_sim.husky.model import Structure
from lg_husky_sim.husky.parameters import Parameter, Parameters
from lg_husky_sim.identification.least_squares import effect_unknown, nominal_unknown, Unknown

#: Parameters that a recalibration moves, with the relative deviation that is believed possible
#: for a nominal value; None takes the tolerance of the model file.
RECALIBRATED: Mapping[str, float | None] = {
    'wheel_damping': 1.2, 'yaw_damping': 1.2, 'command_gain': 0.1, 'turn_ratio': None,
    'mass': None, 'yaw_inertia': None, 'wheel_inertia': None, 'motor_resistance': None,
    'torque_constant': None, 'wheel_radius': 0.02, 'track': 0.02,
}
#: Deviations that a recalibration may use up.
REACH = 2.5
#: Small unknowns of every observation: name, standard deviation, largest size.
EXTRAS = (('latency', 0.008, 0.02), ('delay_wheels', 0.008, 0.02), ('delay_imu', 0.008, 0.02),
          ('delay_pose', 0.008, 0.02), ('gyro_bias', 0.002, 0.005))


@dataclass(frozen=True)
class Candidate:
    """
    One effect with the sizes from which its search begins.

    Parameters
    ----------
    effect : Effect
    starts : tuple of mapping
        Values of its free parameters to begin from.
    signed : bool
        Whether its effect is proportional to its parameters near zero, either sign included, so
        that one column a parameter describes it.
    """

    effect: Effect
    starts: tuple[Mapping[str, float], ...]
    signed: bool

    @property
    def label(self) -> str:
        """Short name: id, side, shape."""
        parts = [self.effect.id]
        parts += [p for p in (self.effect.side, self.effect.shape) if p not in ('', 'none')]
        return ':'.join(parts) + ('@' if self.effect.late else '')


#: Effects that are proportional to their parameters, with either sign.
_SIGNED = {'slope', 'torque_ripple', 'payload', 'wheel_radius_mismatch', 'yaw_pull',
           'yaw_scrub_speed', 'terrain_change', 'gyro_bias', 'gyro_scale', 'encoder_scale',
           'sensor_time_offset', 'viscous_asymmetry'}
#: Value at which a parameter does nothing, where that is not zero.
NEUTRAL = {'gyro_factor': 1.0, 'encoder_factor': 1.0}


def candidates() -> tuple[Candidate, ...]:
    """
    Return the catalogue as candidates, one for each side and shape.

    Returns
    -------
    tuple of Candidate
    """
    found = []
    for name, kind in catalogue().items():
        for side, shape in itertools.product(kind.sides, kind.shapes):
            effect = Effect(name, side, shape, late=kind.needs_onset)
            free = [p for p in effect.parameters() if not p.fixed]
            count = max(len(p.starts) for p in free)
            starts = [{p.name: p.starts[min(i, len(p.starts) - 1)] for p in free}
                      for i in range(count)]
            found.append(Candidate(effect, tuple(starts), name in _SIGNED))
    return tuple(found)


#: Factors by which a number of an effect that is there already is tried to have changed, and the
#: least change as a part of the catalogue's first size.
CHANGED, LEAST_CHANGE = (1.6, 0.6), 0.5


def changed_candidates(structure: Structure, parameters: Parameters) -> tuple[Candidate, ...]:
    """
    Return the effects of a structure as candidates: their numbers may have changed.

    Parameters
    ----------
    structure : Structure
    parameters : Parameters
        The effects' numbers before.

    Returns
    -------
    tuple of Candidate
    """
    found = []
    for effect in structure.effects:
        again = replace(effect, late=True, again=True)
        if effect.again or effect.id not in catalogue() or effect.id == 'belt_compliance':
            continue
        now = {later.name: parameters[before.name] for before, later in zip(
            effect.parameters(), again.parameters(), strict=True)}
        free = [p for p in again.parameters() if not p.fixed]
        starts = []
        for p in free:
            for factor in CHANGED:
                step = (factor - 1.0) * max(abs(now[p.name]), LEAST_CHANGE * abs(p.starts[0]))
                tried = min(max(now[p.name] + step, p.lower), p.upper)
                if tried != now[p.name]:
                    starts.append({**{q.name: now[q.name] for q in free}, p.name: tried})
        for k in range(max(len(p.starts) for p in free)):
            # The catalogue's own sizes, all at once: what a new firmware or preset would do.
            whole = {p.name: p.starts[min(k, len(p.starts) - 1)] for p in free}
            if whole not in starts and whole != now:
                starts.append(whole)
        found.append(Candidate(again, tuple(starts), False))
    return tuple(found)


def still_open(pool: Iterable[Candidate], structure: Structure) -> list[Candidate]:
    """
    Return the candidates that a structure can still take.

    Parameters
    ----------
    pool : iterable of Candidate
    structure : Structure

    Returns
    -------
    list of Candidate
        Without those whose effect it has on that side, and without those that share a number with
        an effect it has: dry friction of the left side and of the right one cannot differ.
    """
    taken = {(e.id, e.side, e.again) for e in structure.effects}
    numbers = {p.name for e in structure.effects for p in e.parameters()}
    return [c for c in pool if (c.effect.id, c.effect.side, c.effect.again) not in taken
            and numbers.isdisjoint(p.name for p in c.effect.parameters())]


def effect_unknowns(effect: Effect, start: Mapping[str, float]) -> tuple[Unknown, ...]:
    """Return the free parameters of an effect as unknowns, scaled by where they start."""
    return tuple(effect_unknown(p, start.get(p.name, p.starts[0]))
                 for p in effect.parameters() if not p.fixed)


def effect_entries(effect: Effect, values: Mapping[str, float]) -> tuple[Parameter, ...]:
    """Return all parameters of an effect at given values, inside their bounds."""
    return tuple(
        p.parameter(min(max(values[p.name], p.lower), p.upper) if p.name in values else None)
        for p in effect.parameters())


def is_exact(parameters: Parameters, name: str) -> bool:
    """Return whether a parameter is given and has no tolerance: it is not varied then."""
    return name in parameters and parameters.entry(name).tolerance == 0.0


def nuisance(parameters: Parameters, structure: Structure, channels: tuple[str, ...]
             ) -> tuple[Unknown, ...]:
    """
    Return what a recalibration may move.

    Parameters
    ----------
    parameters : Parameters
        Nominal: the centres of the priors.
    structure : Structure
        An unknown that an effect of the structure already has is left out.
    channels : tuple of str
        Channels of the observations; extras of absent ones are left out.

    Returns
    -------
    tuple of Unknown
    """
    unknowns = [_within(nominal_unknown(parameters.entry(name), deviation))
                for name, deviation in RECALIBRATED.items() if not is_exact(parameters, name)]
    ids = {effect.id for effect in structure.effects}
    shapes = {effect.shape for effect in structure.effects if effect.id == 'sensor_time_offset'}
    absent = set()
    if 'command_latency' in ids:
        absent.add('latency')
    if 'gyro_bias' in ids or 'yaw_rate' not in channels:
        absent.add('gyro_bias')
    for stream, members in (('wheels', ('wheel_left', 'wheel_right')), ('imu', ('yaw_rate',)),
                            ('pose', ('advance', 'turn'))):
        if stream in shapes or not set(members) & set(channels):
            absent.add(f'delay_{stream}')
    for name, deviation, largest in EXTRAS:
        if name not in absent:
            unknowns.append(Unknown(name, False, 0.0, deviation, -largest, largest,
                                    0.2 * largest, extra=True))
    return tuple(unknowns)


def _within(unknown: Unknown) -> Unknown:
    # Bounds at a few deviations: what lies beyond is no recalibration.
    if not math.isfinite(unknown.deviation):
        return unknown
    reach = REACH * unknown.deviation
    return replace(unknown, lower=max(unknown.lower, math.exp(unknown.centre - reach)),
                   upper=min(unknown.upper, math.exp(unknown.centre + reach)))


def neutral(name: str) -> float:
    """Return the value at which an effect's parameter does nothing."""
    return NEUTRAL.get(name, 0.0)
