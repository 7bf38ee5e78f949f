# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a finding leaves that its name should have explained.

A name outside the catalogue often comes in the guise of one inside it: a gyro that clips looks
like one that reads too little. The guise leaves a residual that is a plain function of what the
sensor should read; the true effect does not. A guise among the physics leaves much that another
effect, or a smooth effort elsewhere in the graph, still explains, beside what it gained itself.
"""

from __future__ import annotations

import math

from lg_husky_sim.diagnosis.events import remain
from lg_husky_sim.diagnosis.everyday import named_rounds
from lg_husky_sim.diagnosis.evidence import FOLDS, folds_of
from lg_husky_sim.diagnosis.fits import Fit, metric_beside
from lg_husky_sim.diagnosis.misfit import is_far
from lg_husky_sim.diagnosis.screening import Projector
from lg_husky_sim.diagnosis.search import Search
from lg_husky_sim.diagnosis.unnamed import ridge, Unnamed
from lg_husky_sim.husky.effects import Subsystem
from lg_husky_sim.identification.problem import Observations
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Knots of a function of the reading.
KNOTS = 9
#: Gain of an effect below which chance and guises weigh [nats]; the most that they take away.
THIN, THIN_WEIGHT = 400.0, 0.5
#: Most that a remaining function of the reading takes away, and the part of the finding's gain
#: at which half of it is taken.
GUISE_WEIGHT, GUISE_HALF = 0.6, 0.1
#: The same by its size, however much the finding gained: most, half of it [nats], and what chance
#: may bring.
SIZE_WEIGHT, SIZE_HALF, CHANCE = 0.3, 400.0, 60.0
#: Part of what the named effects gained from which a further effect that was not adopted, or a
#: smooth effort in another subsystem, says that the names are a guise; least such gain [nats].
FURTHER_PART, SMOOTH_PART, LEAST_LEFT = 0.2, 0.4, 110.0
#: The same for a smooth effort anywhere.
ANYWHERE_PART = 1.0
#: The same for a function of one channel's own reading.
READING_PART = 0.8
#: Least gain of such a smooth effort that is confirmed by itself [nats].
SEEN = 20.0
#: Parts that all end in a torque on an axle.
AXLE = {Subsystem.COMMAND, Subsystem.ELECTRICAL, Subsystem.DRIVETRAIN}
#: The smooth effort that an effect is itself: where no other explains so much more, the element
#: is right and only the shape of its law is not.
CLEARLY = 1.25
OWN = {
    'torque_ripple': ('smooth_torque', 'angle'), 'coulomb_drivetrain': (
        'smooth_torque', 'wheel_rate'), 'viscous_asymmetry': ('smooth_torque', 'wheel_rate'),
    'rolling_resistance': ('smooth_force', 'forward'), 'quadratic_drag': (
        'smooth_force', 'forward'), 'slope': ('smooth_force', 'heading'),
    'yaw_scrub_coulomb': ('smooth_moment', 'yaw'), 'driver_deadband': (
        'smooth_voltage', 'voltage'), 'voltage_saturation': ('smooth_voltage', 'voltage')}
#: Gain below which a name must explain every stretch [nats], and the losses that it may have.
SLIGHT_GAIN, SLIGHT_UNSTABLE = 200.0, 0.12
#: Share of what was unexplained below which names are none where the model stays far off.
FAINT = 0.1


def further_gain(search: Search) -> float:
    """Return the held-out gain of the best effect that was not adopted after others [nats]."""
    last = search.rounds[-1]
    if last.adopted or len(search.rounds) < 2:
        return 0.0
    return max((r.held_out for r in last.rivals), default=0.0)


def is_guise(search: Search, unnamed: Unnamed) -> bool:
    """
    Return whether what was named looks like a guise of something else.

    Parameters
    ----------
    search : Search
        That named something.
    unnamed : Unnamed
        What smooth efforts explain on top of it.

    Returns
    -------
    bool
    """
    rounds = named_rounds(search)
    gained = sum(r.rivals[0].held_out for r in rounds)
    if gained < SLIGHT_GAIN and rounds[0].instability > SLIGHT_UNSTABLE:
        return True
    left = math.prod(1.0 - min(max(r.share, 0.0), 1.0) for r in rounds)
    if (1.0 - left < FAINT and is_far(search)) or remain(search):
        return True
    effects = [r.rivals[0].effect for r in rounds]
    places = {effect.kind.subsystem for effect in effects}
    if places & AXLE:
        places |= AXLE
    own = {OWN[effect.id] for effect in effects if effect.id in OWN}
    mine = max((d.held_out for d in unnamed.descriptions
                if (d.effect.id, d.effect.shape) in own), default=0.0)
    foreign = [d for d in unnamed.descriptions if d.held_out > CLEARLY * mine and (
        search.change is not None or d.confirmed > SEEN)]
    elsewhere = [d for d in foreign if d.effect.kind.subsystem not in places]
    beside = [(further_gain(search), FURTHER_PART),
              (reading_gain(search.observations, search.final), READING_PART)]
    beside += [(d.held_out, SMOOTH_PART) for d in elsewhere[:1]]
    beside += [(d.held_out, ANYWHERE_PART) for d in foreign[:1]]
    return any(gain > max(LEAST_LEFT, part * gained) for gain, part in beside)


def reading_gain(observations: Observations, fit: Fit) -> float:
    """
    Return what a smooth function of one channel's own reading would still explain.

    Parameters
    ----------
    observations : Observations
    fit : Fit
        With what was found.

    Returns
    -------
    float
        Gain on blocks that were not fitted, of the best channel [nats].
    """
    solution = fit.solution
    columns = {name: hats(solution.predicted, observations.channel_mask(name))
               for name in observations.channels}
    # Errors that are a function of the reading last as long as the reading does: an estimate of
    # the noise that does not know of them takes them for noise.
    metric = metric_beside(observations, fit, list(columns.values()))
    deviations = np.array([u.deviation for u in solution.unknowns])
    residual = observations.measured - solution.predicted
    projector = Projector(observations, metric, residual, solution.jacobian, deviations,
                          np.zeros(deviations.size))
    target, folds = projector.residual[:projector.size], folds_of(observations)
    best = 0.0
    for own in columns.values():
        seen = projector.projected(own)[:projector.size]
        gain = 0.0
        for fold in range(FOLDS):
            out = folds == fold
            if not np.any(out) or np.all(out):
                continue
            left = target[out] - seen[out] @ ridge(seen[~out], target[~out])
            gain += 0.5 * float(target[out] @ target[out] - left @ left)
        best = max(best, gain)
    return best


def hats(values: FloatArray, mask: np.typing.NDArray[np.bool_]) -> FloatArray:
    """Return hat functions over the range of some values, zero elsewhere, (n_values, KNOTS)."""
    columns = np.zeros((values.size, KNOTS))
    own = values[mask]
    if own.size:
        low, high = np.quantile(own, [0.01, 0.99])
        place = np.clip((own - low) / max(float(high - low), 1e-9), 0.0, 1.0) * (KNOTS - 1)
        columns[mask] = np.maximum(0.0, 1.0 - np.abs(place[:, None] - np.arange(KNOTS)))
    return columns


def belief(gain: float, share: float, remaining: float) -> float:
    """
    Return by how much a name is believed, beside its rivals.

    Parameters
    ----------
    gain : float
        Held-out gain of the finding [nats].
    share : float
        Of what was unexplained.
    remaining : float
        What is still explained beside it [nats]: by :func:`reading_gain`, or by a further effect
        that was not adopted.

    Returns
    -------
    float
        1 for full belief.
    """
    thin = THIN_WEIGHT * math.exp(-max(gain, 0.0) / THIN) * (1.0 - min(max(share, 0.0), 1.0))
    left = max(remaining, 0.0) / max(gain, 1.0)
    size = max(remaining - CHANCE, 0.0)
    return (1.0 - thin) * (1.0 - GUISE_WEIGHT * left / (left + GUISE_HALF)) * (
        1.0 - SIZE_WEIGHT * size / (size + SIZE_HALF))
