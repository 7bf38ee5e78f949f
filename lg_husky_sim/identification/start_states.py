# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The state at the start of each segment as unknowns: which, with what prior, and in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

from lg_husky_sim.errors import FitError
from lg_husky_sim.husky.effects import Subsystem
from lg_husky_sim.husky.model import Structure
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.identification.fit_segments import (
    at_rest,
    correction_name,
    CORRECTIONS,
    SETTLE,
    SETTLE_ESTIMATED,
)
from lg_husky_sim.identification.least_squares import Unknown
from lg_husky_sim.identification.problem import Observations
from lg_husky_sim.identification.settings import setting
from lg_husky_sim.signals import BodyTwist, FloatArray
from lg_husky_sim.simulation.simulator import Simulator
import numpy as np
from scipy.linalg import expm
from scipy.special import ndtri

#: Name of the whole among the unknowns of a recording.
INITIAL_STATE = 'initial_state'
#: Corrections of the start: unit, step of a difference, name in ``config/identification.yaml``,
#: and the place of its factor among those by which another robot is faster than the Husky.
QUANTITIES: dict[str, tuple[str, float, str, int]] = {
    'initial_forward': ('m/s', 0.01, 'start_forward', 0),
    'initial_yaw': ('rad/s', 0.01, 'start_yaw', 1),
    'initial_left': ('rad/s', 0.05, 'start_wheels', 2),
    'initial_right': ('rad/s', 0.05, 'start_wheels', 2),
}


@dataclass(frozen=True)
class StartState:
    """
    One estimated number of the state at the start of one segment.

    Parameters
    ----------
    name : str
        Such as ``initial_forward@drive/3``.
    quantity, segment, unit : str
        The two parts of the name, and the unit.
    measured : float
        What the recording says [unit].
    value, low, high : float
        Correction of it and its 95 % interval [unit].
    determined : bool
        Whether the interval is narrower than half of what was given to the fit as prior.
    at_bound : bool

    """

    name: str
    quantity: str
    segment: str
    unit: str
    measured: float
    value: float
    low: float
    high: float
    determined: bool
    at_bound: bool


def settle_of(structure: Structure, nuisance: Sequence[str]) -> float:
    """
    Return from when the values of a segment that begins in motion can be used [s].

    Parameters
    ----------
    structure : Structure
        Effects of the command, and delays, reach back.
    nuisance : sequence of str
        Unknowns of the recordings.

    Returns
    -------
    float
        Early where the start is estimated and nothing reaches back before it. What was
        commanded and done before a segment is not recorded, and a dead time, a ramp or a speed
        loop still answers to it.

    """
    back = any(one.kind.subsystem is Subsystem.COMMAND or any(p.delays for p in one.parameters())
               for one in structure.effects)
    back = back or any(name == 'latency' or name.startswith('delay') for name in nuisance)
    return SETTLE if back or INITIAL_STATE not in nuisance else SETTLE_ESTIMATED


def remembered(plant: Plant, settle: float) -> tuple[int, ...]:
    """
    Return which parts of a start the plant remembers: places in :data:`CORRECTIONS`.

    Parameters
    ----------
    plant : Plant
        As given, before the fit.
    settle : float
        When the first values are used [s].

    Returns
    -------
    tuple of int
        Those that still show in wheel rates or body then, friction and other laws apart; what
        the model has forgotten is not worth an unknown. The paper's wheels follow their motors
        in two milliseconds, a controller's do not.

    """
    one = plant.sets[0]
    simulator = Simulator(plant, settle, fine_pose=False)
    later = one.rows[:4] @ expm(one.a * settle)
    kept = []
    for place in range(len(CORRECTIONS)):
        forward, yaw, left, right = (float(place == k) for k in range(4))
        state = simulator.initial(twist=BodyTwist(forward, yaw), wheel_rates=(left, right))
        left_over: FloatArray = later @ state.flat[:state.n]
        if float(np.max(np.abs(left_over))) > setting('remembered'):
            kept.append(place)
    return tuple(kept)


def start_unknowns(data: Observations, plant: Plant, settle: float,
                   faster: tuple[float, float, float] = (1.0, 1.0, 1.0)
                   ) -> tuple[Unknown, ...]:
    """
    Return the corrections of the start of every segment that begins in motion.

    Parameters
    ----------
    data : Observations
        Segments, of which some begin in motion.
    plant : Plant
        As given, before the fit.
    settle : float
        When the first values are used [s].
    faster : tuple of float
        The robot's forward speed, yaw rate and wheel rates, in parts of the Husky's.

    Returns
    -------
    tuple of Unknown

    Raises
    ------
    FitError
        If two segments have one name, or the data have common errors, which tie all segments to
        each other.

    """
    if data.common is not None:
        raise FitError(f'{INITIAL_STATE} cannot be estimated where errors are common to all '
                       'segments')
    names = [segment.name for segment in data.segments]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise FitError(f'{INITIAL_STATE} needs segments with names of their own; '
                       f'two are named {twice}')
    found = []
    places = remembered(plant, settle)
    for number, segment in enumerate(data.segments):
        if at_rest(segment):
            continue
        for place in places:
            _, step, entry, which = QUANTITIES[CORRECTIONS[place]]
            times = faster[which]
            kind = 'measured' if segment.measured[place] else 'unmeasured'
            bound = times * setting(f'{entry}_bound')
            found.append(Unknown(
                correction_name(segment, place), False, 0.0, times * setting(f'{entry}_{kind}'),
                -bound, bound, times * step, extra=True, local=(number, place)))
    return tuple(found)


def start_states(data: Observations, unknowns: Sequence[Unknown], values: Sequence[float],
                 deviations: FloatArray) -> tuple[StartState, ...]:
    """
    Return the estimated starts.

    Parameters
    ----------
    data : Observations
        In which the segments stand.
    unknowns : sequence of Unknown
        Those with a segment of their own.
    values : sequence of float
        Estimates.
    deviations : numpy.ndarray, shape (n_unknowns,)
        Their standard deviations.

    """
    found = []
    reach = float(ndtri(0.975))
    for unknown, value, deviation in zip(unknowns, values, map(float, deviations),
                                         strict=True):
        if unknown.local is None:
            continue
        segment, place = data.segments[unknown.local[0]], unknown.local[1]
        quantity = CORRECTIONS[place]
        found.append(StartState(
            unknown.name, quantity, segment.name, QUANTITIES[quantity][0],
            segment.initial_state[place], value,
            value - reach * deviation, value + reach * deviation,
            deviation < setting('prior_share') * unknown.deviation,
            abs(value) >= unknown.upper * (1.0 - 1e-9)))
    return tuple(found)


HEAD = ('start of the segments', 'segments', 'determined', 'typical correction', 'largest',
        'in segment', 'typical 95 % ±', 'unit')


def summary(starts: Sequence[StartState]) -> list[tuple[str, ...]]:
    """
    Return a row for each quantity, whatever the number of segments.

    Parameters
    ----------
    starts : sequence of StartState
        Of all segments, in any order.

    Returns
    -------
    list of tuple of str
        Cells under :data:`HEAD`: in how many segments the data and not the prior determine it,
        the median size of the corrections, the largest and where it is, and the median half
        width of the intervals.

    """
    rows: list[tuple[str, ...]] = []
    for quantity in CORRECTIONS:
        own = [one for one in starts if one.quantity == quantity]
        if own:
            most = max(own, key=lambda one: abs(one.value))
            rows.append((
                quantity, str(len(own)), str(sum(one.determined for one in own)),
                f'{float(np.median([abs(o.value) for o in own])):.3g}',
                f'{most.value:+.3g}', most.segment,
                f'{float(np.median([0.5 * (o.high - o.low) for o in own])):.2g}', most.unit))
    return rows


def start_warnings(starts: Sequence[StartState]) -> list[str]:
    """Return a sentence for each quantity that ended on a bound somewhere."""
    said = []
    for quantity in CORRECTIONS:
        own = [one for one in starts if one.quantity == quantity]
        stuck = [one for one in own if one.at_bound]
        if stuck:
            said.append(f'{quantity} ended on its bound {math.copysign(1.0, stuck[0].value):+.0f}'
                        f'·{abs(stuck[0].value):g} {stuck[0].unit} in {len(stuck)} of {len(own)} '
                        f'segments, first in {stuck[0].segment}')
    return said
