# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The finding where something is missing and nothing of the catalogue is its name."""

from __future__ import annotations

import math

from lg_husky_sim.diagnosis.candidates import candidates
from lg_husky_sim.diagnosis.confidence import p_value
from lg_husky_sim.diagnosis.events import (
    elements_of,
    event_words,
    NOW_AND_THEN,
    place_of,
    SHOWS,
    what_happens,
)
from lg_husky_sim.diagnosis.everyday import open_rounds
from lg_husky_sim.diagnosis.judge import DESCRIBED, rivals_of, side_words
from lg_husky_sim.diagnosis.misfit import farthest, is_far
from lg_husky_sim.diagnosis.result import Finding
from lg_husky_sim.diagnosis.search import Search
from lg_husky_sim.diagnosis.unnamed import Description, Unnamed
from lg_husky_sim.identification.problem import Observations
import numpy as np

#: Way per wheel angle [m/rad] below which the ground does not push the robot: a twentieth of
#: the smallest wheel.
NO_GRIP = 0.015
#: Arguments of a smooth effort, in words.
WHEEL_ANGLES = {'angle': "the wheel's angle", 'angle_left': "the left wheel's angle",
                'angle_right': "the right wheel's angle"}
#: How the sentence begins where no entry of the catalogue comes near.
NOTHING_NEAR = 'Something is missing that is not in the catalogue, and nothing in it comes near.'


def rolls_without_moving(observations: Observations) -> bool:
    """
    Return whether the wheels turn and the robot does not follow.

    Parameters
    ----------
    observations : Observations

    Returns
    -------
    bool
        True where the measured way is unrelated to that of the wheels at all.
    """
    ways: list[float] = []
    rolled: list[float] = []
    for piece in observations.pieces:
        by_name = {channel.name: channel for channel in piece.channels}
        if not {'wheel_left', 'wheel_right', 'advance'} <= set(by_name):
            return False
        advance = by_name['advance']
        sides = [np.interp(advance.times, by_name[n].times, by_name[n].values)
                 for n in ('wheel_left', 'wheel_right')]
        ways.extend(advance.values)
        rolled.extend(0.5 * (sides[0] + sides[1]))
    wheel, way = np.array(rolled), np.clip(np.array(ways), -3.0, 3.0)
    if wheel.size < 50 or float(np.std(wheel)) < 0.3:
        return False
    per_rate = float(wheel @ way / (wheel @ wheel))
    return abs(per_rate) < NO_GRIP


def no_ground_reaction(search: Search) -> Finding:
    """
    Return the finding for wheels that turn off the ground.

    Parameters
    ----------
    search : Search

    Returns
    -------
    Finding
    """
    return Finding(
        'unknown', 'both', 'traction', ('B_FL', 'B_RL', 'B_FR', 'B_RR', 'M_H', 'J_H'),
        'whenever the wheels turn', None, (), 0.0, math.nan, 0.0,
        rivals_of(search.rounds[0], None),
        'There is no ground reaction: the wheels turn as commanded and the robot stays where it '
        'is. The wheels are off the ground, or the pose is not that of this robot.')


def description_words(description: Description) -> str:
    """Return a smooth description in words."""
    effect = description.effect
    shape = WHEEL_ANGLES.get(effect.shape, effect.shape.replace('_', ' '))
    words = effect.kind.title.replace('{shape}', shape)
    return words + side_words(effect)


def distance_words(search: Search) -> str:
    """Return in a sentence how far the data are from the model."""
    channel, square, _ = farthest(search)
    than = ('noise' if search.change is None else 'distance in the earlier recordings, errors '
            'taken off that may be alike in all')
    return (f'The {channel.replace("_", " ")} is far from the model: {square:.1f} times its '
            f'{than} (mean square).')


def unnamed_finding(search: Search, unnamed: Unnamed) -> tuple[Finding, Description | None]:
    """
    Return the finding of an unknown effect.

    Parameters
    ----------
    search : Search
    unnamed : Unnamed

    Returns
    -------
    Finding
        With the most likely subsystem.
    Description or None
        The description to put into the model, where it predicts held-out data better.
    """
    first, seen = open_rounds(search)[0], what_happens(search)
    rivals = rivals_of(first, None)
    near = max(first.rivals, key=lambda r: r.held_out, default=None)
    best = unnamed.descriptions[0] if unnamed.descriptions else None
    described = best is not None and best.held_out > DESCRIBED and unnamed.share > 0.0
    if described and best is not None and (near is None or best.held_out > 0.5 * near.held_out):
        kind = best.effect.kind
        words = (f'Something is missing that is not in the catalogue. It is described best by '
                 f'{description_words(best)}, between {min(best.knots):.3g} and '
                 f'{max(best.knots):.3g} {kind.parameters[-1].unit}.')
        if first.adopted:
            words += (f' The nearest entry, {first.rivals[0].effect.id}, leaves too much to be '
                      'its name.')
        gain, share = best.held_out, unnamed.share
    elif seen and (near is None or near.held_out < DESCRIBED):
        return Finding('unknown', 'none', place_of(seen).value, elements_of(seen), NOW_AND_THEN,
                       None, (), 0.0, math.nan, 0.0, rivals, f'{NOTHING_NEAR} {event_words(seen)}'
                       ), None
    elif near is None and not first.scores:
        channel, _, _ = farthest(search)
        return Finding('unknown', 'none', SHOWS[channel].value, (), 'not determined', None, (),
                       0.0, math.nan, 0.0, (), f'{NOTHING_NEAR} {distance_words(search)}'), None
    else:
        effect = near.effect if near is not None else first.scores[0].signature.candidate.effect
        kind = effect.kind
        # What screening promised, and no refit kept, is no gain on held-out data.
        gain, share = math.nan if near is None else near.held_out, max(first.share, 0.0)
        doubt = ('leaves too much to be its name' if first.adopted else 'that not steadily '
                 'enough over held-out stretches to be its name')
        words = (f'Something is missing that is not in the catalogue; the nearest entry, '
                 f'{effect.id}, explains {100.0 * share:.1f} % of it, and '
                 f'{doubt}.')
    place, elements, regime = kind.subsystem, kind.elements, 'not determined'
    if seen:
        place, elements, regime = place_of(seen), elements_of(seen), NOW_AND_THEN
        words += f' {event_words(seen)}'
    elif is_far(search):
        words += f' {distance_words(search)}'
    chance = math.nan if math.isnan(gain) else p_value(gain, 9, len(candidates()))
    return Finding('unknown', 'none', place.value, elements, regime, None, (), gain, chance,
                   share, rivals, words), best if described else None
