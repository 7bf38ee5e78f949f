# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Whether the wheels turn with more than their nominal inertia.

Data sheets and robot descriptions give the inertia of wheels. What a motor has to turn has that of
its rotor J as well, times the square of the gear ratio N: J_w + N^2 J. With N = 78.71, a rotor of
1e-5 kg m^2 is 0.06 kg m^2. As long as nothing says so, the nominal number is taken for right
within its tolerance; where effects are compared, a robot of other rotors is a rival of each.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
import math

from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.evidence.point import Point
from lg_husky_sim.diagnosis.selection.nominal import is_distorted, nominal_of
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.errors import LgHuskyError


def with_any_rotors(point: Point) -> Point:
    """Return a point whose wheel inertia is known no better than if it left rotors out."""
    spread = setting('rotor_spread')
    return replace(point, unknowns=tuple(
        replace(u, deviation=max(u.deviation, spread)) if u.name == 'wheel_inertia' else u
        for u in point.unknowns))


def with_rotors_of(point: Point, other: Point) -> Point:
    """Return a point whose wheel inertia is known as well as that of another one."""
    known = {u.deviation for u in other.unknowns if u.name == 'wheel_inertia'}
    return replace(point, unknowns=tuple(
        replace(u, deviation=max(known, default=u.deviation)) if u.name == 'wheel_inertia' else u
        for u in point.unknowns))


def other_rotors(evidence: Evidence, base: Fit) -> Fit | None:
    """
    Return a model with a larger wheel inertia where that is likelier than chance has it.

    Parameters
    ----------
    evidence : Evidence
        Drives, and the noise under which fits are made.
    base : Fit
        With the nominal inertia within its tolerance.

    Returns
    -------
    Fit or None
        None where the base may have any inertia already, or nothing says that it is larger.

    """
    point = with_any_rotors(base.point)
    wider = sum(math.log(new.deviation / old.deviation) for new, old in zip(
        point.unknowns, base.point.unknowns, strict=True) if new is not old)
    if not wider:
        return None
    fits = [evidence.fit(point)]
    if is_distorted(base):
        # A model with an effect that only other numbers can bear runs away there.
        with suppress(LgHuskyError):
            fits.append(evidence.fit(nominal_of(point)))
    best = min(fits, key=lambda fit: fit.cost)
    by_chance = wider - math.log(setting('false_alarm_rate'))
    # What was left out can only be more.
    more = any(u.name == 'wheel_inertia' and place > u.centre for u, place in zip(
        best.point.unknowns, best.point.places.tolist(), strict=True))
    return best if more and base.cost - best.cost > by_chance else None


def rotor_notes(point: Point) -> tuple[str, ...]:
    """Return in a sentence what a fit has for the wheel inertia, where it is any larger one."""
    spread, found = setting('rotor_spread'), []
    for u, place in zip(point.unknowns, point.places.tolist(), strict=True):
        nominal, value = (f'{u.value(one):.2g} kg·m²' for one in (u.centre, place))
        if (u.name == 'wheel_inertia' and u.deviation == spread and place > u.centre
                and value != nominal):
            found.append(f'the wheels of each side seem to have an inertia of {value}, not '
                         f'{nominal}: rotors count by the square of their gear ratio')
    return tuple(found)
