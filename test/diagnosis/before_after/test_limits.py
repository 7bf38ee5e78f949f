# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What the limit of another recording costs a recording."""

from __future__ import annotations

from dataclasses import replace

from lg_husky_sim.diagnosis.before_after.base import Base, base_of
from lg_husky_sim.diagnosis.before_after.drives import Drive, drives
from lg_husky_sim.diagnosis.before_after.evidence import Quadratic
from lg_husky_sim.diagnosis.before_after.fitting import Prior
from lg_husky_sim.diagnosis.before_after.limits import with_limits
from lg_husky_sim.diagnosis.before_after.prediction import residual
from lg_husky_sim.diagnosis.before_after.recording_fits import quadratic
from lg_husky_sim.diagnosis.before_after.settings import settings
from lg_husky_sim.diagnosis.before_after.whitening import first_noise
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np

KNOWN = settings()
BASE = base_of(KNOWN, load_model().parameters)
WHITE = first_noise(KNOWN).among(('left', 'right'))
K = BASE.names.index('limit_forward')


def at(limit: float, of: Base = BASE) -> FloatArray:
    """Return the start with a limit of the forward speed [m/s]."""
    z = np.array(of.start)
    z[K] = of.place('limit_forward', limit)
    return z


def drive(limit: float) -> Drive:
    """Return a drive of a robot of such a limit, at 0.8 m/s and back, as it is predicted."""
    times, stamps = np.arange(0.0, 12.0, 0.05), np.arange(0.0, 12.0, 0.02)
    command = np.column_stack([np.where(times % 6.0 < 3.0, 0.8, -0.3), np.zeros(times.size)])
    streams = {'command': TimeSeries(times, command, ('forward', 'yaw')),
               'wheels': TimeSeries(stamps, np.zeros((stamps.size, 2)), ('left', 'right'))}
    (one,) = drives(Recording('rec1', 'rec1', streams, 0), KNOWN.simulation['step'], KNOWN.bins,
                    0.5, 3.0)
    there = one.bins['wheels']
    return replace(one, bins={'wheels': replace(
        there, values=there.values - residual(BASE, one, at(limit))['wheels'])})


def likelihoods(true: float, found: float, other: float) -> tuple[Quadratic, Quadratic]:
    """Return that by the derivatives alone, and as it counts beside another recording's limit."""
    one, z = drive(true), at(found)
    prior = Prior(BASE.start, BASE.sd, np.array([q.name not in KNOWN.runs_as
                                                 for q in KNOWN.quantities]))
    plain = quadratic(BASE, one, WHITE, z, prior)
    return plain, with_limits(BASE, [one], WHITE, prior, {'rec1': z, 'rec2': at(other)}, plain)


def costs(true: float, found: float, other: float) -> tuple[float, float]:
    """Return what another limit costs by the derivatives alone, and as it counts [nats]."""
    def cost(of: Quadratic) -> float:
        return of.value(at(other)) - of.value(at(found))
    plain, counted = likelihoods(true, found, other)
    return cost(plain), cost(counted)


def test_a_limit_that_is_not_reached_costs_what_a_lower_one_would() -> None:
    promised, counted = costs(true=2.0, found=2.0, other=0.5)
    assert abs(promised) < 1e-6
    assert counted > 1000.0


def test_one_that_is_reached_keeps_its_derivatives() -> None:
    promised, counted = costs(true=0.6, found=0.6, other=0.63)
    assert counted > 100.0
    assert counted == promised


def test_one_that_was_only_found_costs_no_more_than_none() -> None:
    """The robot has none; at the one found here the likelihood is as steep as at a true one."""
    promised, counted = costs(true=2.0, found=0.798, other=1.5)
    assert promised > 100.0
    assert counted < 0.05 * promised


def test_a_limit_that_is_exceeded_twice_is_so_without_either_time() -> None:
    """At 0.8 m/s from 0 s to 3 s and from 6 s to 9 s; stretches are 4 s long."""
    _, counted = likelihoods(true=2.0, found=2.0, other=0.5)
    assert 0.3 < counted.lasting[K] < 0.7


def test_one_that_is_reached_is_not_exceeded() -> None:
    _, counted = likelihoods(true=0.6, found=0.6, other=0.63)
    assert K not in counted.lasting
