# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a wheel rate in a recording means.

A driver that counts ticks tells the mean over the time in which it counted; a motor controller, or
another simulator, the rate of the moment. A wheel answers to a voltage within a few milliseconds:
taken for the other, the first value after each step of the command is off by a good part of the
step, and a belt that gives way seems to be there.
"""

from __future__ import annotations

from lg_husky_sim.diagnosis.fits import first_metric, Fit, fit_structure, recalibrate
from lg_husky_sim.diagnosis.rounds import left_by
from lg_husky_sim.diagnosis.search import Search
from lg_husky_sim.husky.model import Structure
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.identification.problem import Observations

#: Gain from which rates are taken for those of the moment [nats]: before and after something was
#: found, which the other reading may have led to.
CLEARLY, STILL = 40.0, 100.0


def is_momentary(observations: Observations) -> bool:
    """Return whether the wheel rates are taken for those of the moment."""
    return any(piece.momentary for piece in observations.pieces)


def as_read(observations: Observations, structure: Structure, nominal: Parameters
            ) -> tuple[Observations, Fit]:
    """
    Return observations whose wheel rates are what the recalibrated model says that they are.

    Parameters
    ----------
    observations : Observations
    structure : Structure
        Of the model in doubt.
    nominal : Parameters

    Returns
    -------
    Observations
        As given, unless rates of the moment are clearly nearer to the data.
    Fit
        The model, recalibrated to them.
    """
    counted = recalibrate(observations, structure, nominal)
    if not {'wheel_left', 'wheel_right'} & set(observations.channels):
        return observations, counted
    momentary = observations.read_as(True)
    again = recalibrate(momentary, structure, nominal, counted)
    metric = first_metric(observations, counted.solution.predicted)
    gain = left_by(observations, counted, metric) - left_by(momentary, again, metric)
    return (momentary, again) if gain > CLEARLY else (observations, counted)


def read_otherwise(search: Search) -> Observations | None:
    """
    Return observations to search again, where what was found says that rates are the others.

    An effect may look as if rates were those of the moment; once it is in the model, it does not.

    Parameters
    ----------
    search : Search

    Returns
    -------
    Observations or None
        None where nothing speaks against how the rates were read: against means clearly, against
        rates of the moment at all.
    """
    observations, final, metric = search.observations, search.final, search.rounds[-1].metric
    if final is search.plain or not {'wheel_left', 'wheel_right'} & set(observations.channels):
        return None
    other = observations.read_as(not is_momentary(observations))
    again = fit_structure(other, final.structure, search.nominal, metric, final.solution.values,
                          {**final.parameters, **final.solution.values})
    if again is None:
        return None
    gain = left_by(observations, final, metric) - left_by(other, again, metric)
    return other if gain > (0.0 if is_momentary(observations) else STILL) else None
