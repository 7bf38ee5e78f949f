# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
What happens now and then, and no effect explains.

A command that stalls or a driver that cuts back leaves the model right for most of the time and
far off for moments. The noise model takes weight from such moments, so that they decide nothing
between effects; here they are counted.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
import math

from lg_husky_sim.diagnosis.fits import EVENT, Fit
from lg_husky_sim.diagnosis.lost_commands import without_lost_commands
from lg_husky_sim.diagnosis.rounds import Round
from lg_husky_sim.diagnosis.search import Search
from lg_husky_sim.husky.effects import Subsystem
from lg_husky_sim.identification.noise import Metric, scales, spread
from lg_husky_sim.identification.pieces import UNITS
from lg_husky_sim.identification.problem import Observations
import numpy as np

#: Largest squared residual, in units of its robust deviation: a larger one counts as this.
LARGEST = 1e4
#: What moments hold beyond what the rest would let expect, per value, from which something is
#: missing [nats]: a lost command leaves up to 0.2, a gear's play 0.4. How many moments, at least.
MUCH, TIMES = 1.0, 3
#: The same where it is asked what changed: multiple of that before the change. Moments are others
#: than before if they come so many times as often, or leave the model so many times as far.
BEFORE, OTHERS = 3.0, 2.0
#: Parts that names leave too much of: of what moments held without them, if they leave so much of
#: what was unexplained in between, too. A robot that was understood may still stumble.
LEFT, BETWEEN = 0.5, 0.15
#: Gap between two moments [s], and how many of them are told. Time that a moment may take until
#: the robot follows the model again [s].
GAP, TOLD, AFTERWARDS = 0.5, 3, 1.0
#: Part of the largest channel's from which both sides are hit.
BOTH = 0.25
#: Part of the robot that a channel tells of, where nothing else does.
SHOWS = {'wheel_left': Subsystem.DRIVETRAIN, 'wheel_right': Subsystem.DRIVETRAIN,
         'yaw_rate': Subsystem.ROTATION, 'turn': Subsystem.ROTATION,
         'advance': Subsystem.TRANSLATION}
#: Elements of the graph that a part begins with, where no law says more.
ELEMENTS = {Subsystem.COMMAND: ('V_S1', 'V_S2'), Subsystem.ROTATION: ('J_H',),
            Subsystem.TRANSLATION: ('M_H',)}
#: Regime of such a finding.
NOW_AND_THEN = 'now and then'


@dataclass(frozen=True)
class Moments:
    """
    Moments in which one channel leaves a model.

    Parameters
    ----------
    excess : float
        What they hold beyond :data:`~lg_husky_sim.diagnosis.fits.EVENT` robust deviations, per
        value of the channel [nats].
    width : float
        Robust deviation of the residual, in units of the noise; at least 1.
    largest : float
        Largest residual in a moment [unit of the channel].
    count : int
        Values of the channel.
    begins : tuple of (str, float)
        Recording and time [s] of each moment, the one that holds most first.
    """

    excess: float
    width: float
    largest: float
    count: int
    begins: tuple[tuple[str, float], ...]


def moments(observations: Observations, fit: Fit, widths: Mapping[str, float] | None = None,
            recordings: Collection[str] | None = None) -> dict[str, Moments]:
    """
    Return the moments of each channel in which it leaves a fit.

    Parameters
    ----------
    observations : Observations
    fit : Fit
    widths : mapping of str to float, optional
        Robust deviations of channels; of those not given, that of this fit's residual.
    recordings : collection of str, optional
        Those that count; all if not given.

    Returns
    -------
    dict of str to Moments
    """
    predicted = fit.solution.predicted
    residual = observations.measured - predicted
    scaled = residual * scales(observations, residual, predicted)
    found = {}
    for name in observations.channels:
        rows = [s for s in observations.slices if s.channel == name and (
            recordings is None or observations.pieces[s.piece].recording in recordings)]
        if not rows:
            continue
        whole = np.concatenate([np.arange(s.first, s.last) for s in rows])
        pieces = np.concatenate([np.full(s.last - s.first, s.piece) for s in rows])
        width = (widths or {}).get(name) or max(spread(scaled[whole]), 1.0)
        square = np.minimum((scaled[whole] / width) ** 2, LARGEST)
        over = 0.5 * np.maximum(square - EVENT ** 2, 0.0)
        inside = np.flatnonzero(over > 0.0)
        begins: list[tuple[float, str, float]] = []
        if inside.size:
            times, where = observations.times[whole[inside]], pieces[inside]
            cut = np.flatnonzero((np.diff(times) > GAP) | (np.diff(where) != 0)) + 1
            for part in np.split(np.arange(inside.size), cut):
                begins.append((float(np.sum(over[inside[part]])),
                               observations.pieces[where[part[0]]].recording,
                               float(times[part[0]])))
            begins.sort(key=lambda one: -one[0])
        found[name] = Moments(
            float(np.mean(over)), width,
            float(np.max(np.abs(residual[whole[inside]]), initial=0.0)), whole.size,
            tuple((recording, time) for _, recording, time in begins))
    return found


def what_happens(search: Search) -> dict[str, Moments]:
    """
    Return the channels with moments that chance, or the robot before a change, does not have.

    Parameters
    ----------
    search : Search

    Returns
    -------
    dict of str to Moments
        Of its final fit; empty where nothing happens.
    """
    before, after = search.sides
    observations, final = search.observations, search.final
    found = moments(observations, final, None, after)
    if any(one.excess > MUCH for one in found.values()):
        begins = {begin for one in found.values() for begin in one.begins}
        found = moments(observations, without_lost_commands(observations, final, begins),
                        {name: one.width for name, one in found.items()}, after)
    usual = moments(observations, final, None, before)
    return {name: one for name, one in found.items() if len(one.begins) >= TIMES
            and one.excess > MUCH + BEFORE * (usual[name].excess if name in usual else 0.0)
            and (name not in usual or are_others(one, usual[name]))}


def are_others(one: Moments, usual: Moments) -> bool:
    """
    Return whether moments are others than those before a change.

    Parameters
    ----------
    one, usual : Moments
        Of one channel, after and before it: a floor on which wheels stick and slip lets them do so
        before a change, too.

    Returns
    -------
    bool
        Whether they come more often, or leave the model farther.
    """
    if not usual.begins:
        return True
    often = (len(one.begins) / one.count) / ((len(usual.begins) + 1) / usual.count)
    return often > OTHERS or one.largest > OTHERS * usual.largest


def energy_in_moments(search: Search, first: Round) -> float:
    """
    Return what the moments of the recordings in question hold before a round adopts anything.

    Parameters
    ----------
    search : Search
    first : Round

    Returns
    -------
    float
        Half the sum of squares of what the model leaves in them, with their full weight [nats]:
        what screening likes for so much it may like for a lost command alone.
    """
    observations = search.observations
    predicted = first.base.solution.predicted
    residual = observations.measured - predicted
    begins = {begin for one in moments(observations, first.base, None, search.sides[1]).values()
              for begin in one.begins}
    full = Metric(scales(observations, residual, predicted), first.metric.filters,
                  first.metric.parts)
    white = full.whiten(observations, residual)
    inside = np.zeros(white.size, dtype=bool)
    for one in observations.slices:
        times = observations.times[one.first:one.last]
        for recording, begin in begins:
            if observations.pieces[one.piece].recording == recording:
                inside[one.first:one.last] |= (times >= begin - GAP) & (
                    times <= begin + AFTERWARDS)
    return 0.5 * float(np.sum(white[inside] ** 2))


def remain(search: Search) -> bool:
    """
    Return whether names leave most of what happens in moments.

    Parameters
    ----------
    search : Search
        That adopted something.

    Returns
    -------
    bool
    """
    found = what_happens(search)
    between = math.prod(1.0 - min(max(r.share, 0.0), 1.0) for r in search.rounds if r.adopted)
    if not found or between < BETWEEN:
        return False
    plain = moments(search.observations, search.plain,
                    {name: one.width for name, one in found.items()}, search.sides[1])
    most = max(found, key=lambda name: found[name].excess)
    return found[most].excess > LEFT * plain[most].excess


def place_of(found: Mapping[str, Moments]) -> Subsystem:
    """
    Return the part of the robot that moments tell of.

    Parameters
    ----------
    found : mapping of str to Moments
        At least one channel.

    Returns
    -------
    Subsystem
        What both sides share is the way of the command; a wheel alone is its drivetrain.
    """
    most = max(found, key=lambda name: found[name].excess)
    if all(name in found and found[name].excess > BOTH * found[most].excess
           for name in ('wheel_left', 'wheel_right')):
        return Subsystem.COMMAND
    return SHOWS[most]


def elements_of(found: Mapping[str, Moments]) -> tuple[str, ...]:
    """Return the elements of the graph that moments tell of."""
    place = place_of(found)
    if place is Subsystem.DRIVETRAIN:
        left = max(found, key=lambda name: found[name].excess) == 'wheel_left'
        return ('J_LW',) if left else ('J_RW',)
    return ELEMENTS[place]


def event_words(found: Mapping[str, Moments]) -> str:
    """Return in a sentence what happens, and where to look for it."""
    name = max(found, key=lambda one: found[one].excess)
    one = found[name]
    where = ', '.join(f'{time:.1f} s of {recording}' for recording, time in one.begins[:TOLD])
    side, _, wheel = name.rpartition('_')
    channel = f'{wheel} {side}' if side == 'wheel' else name.replace('_', ' ')
    return (f'In {len(one.begins)} moments the {channel} leaves the model by up to '
            f'{one.largest:.3g} {UNITS[name]}, most at {where}; between them it follows.')
