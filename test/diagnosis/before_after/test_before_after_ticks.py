# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The base of a comparison may apply commands at its own ticks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from lg_husky_sim.diagnosis.before_after.base import Base, base_of
from lg_husky_sim.diagnosis.before_after.drives import Drive, drives
from lg_husky_sim.diagnosis.before_after.fitting import Prior
from lg_husky_sim.diagnosis.before_after.motion import moved
from lg_husky_sim.diagnosis.before_after.prediction import predicted, residual, residuals
from lg_husky_sim.diagnosis.before_after.recording_fits import RecordingFits
from lg_husky_sim.diagnosis.before_after.settings import settings
from lg_husky_sim.diagnosis.before_after.ticks import at_own_ticks, likelier
from lg_husky_sim.diagnosis.before_after.whitening import first_noise
from lg_husky_sim.diagnosis.evidence.clock_search import at_ticks
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import TimeSeries
from lg_husky_sim.threads import Threads
import numpy as np
import pytest

PERIOD = 0.073


@pytest.fixture
def pool() -> Iterator[Threads]:
    """Return two threads."""
    with Threads(2) as threads:
        yield threads


def base() -> Base:
    """Return a base of wheels and an IMU."""
    return base_of(settings(), load_model().parameters, streams=('wheels', 'imu'))


def sent(seed: int) -> Drive:
    """Return a drive of unlike steps, with sensors that have read nothing yet."""
    rng = np.random.default_rng(seed)
    times = np.arange(0.0, 30.0, 0.05) + rng.uniform(0.0, 0.01, 600)
    held = np.repeat(rng.uniform(-0.8, 0.8, (60, 2)), 10, axis=0)

    def nothing(hertz: float, *names: str) -> TimeSeries:
        at = np.arange(0.0, 30.0, 1.0 / hertz)
        return TimeSeries(at, np.zeros((at.size, len(names))), names)
    streams = {'command': TimeSeries(times, held, ('forward', 'yaw')),
               'wheels': nothing(40.0, 'left', 'right'),
               'imu': nothing(50.0, 'yaw_rate', 'accel_x', 'accel_y')}
    known = settings()
    (found,) = drives(Recording(f'rec{seed}', '', streams, 0), known.simulation['step'],
                      known.bins, known.fit['settle'], known.fit['shortest'])
    return found


def driven(drive: Drive, got: TimeSeries) -> Drive:
    """Return a drive as sensors read it of a base that got some commands."""
    of, rng = base(), np.random.default_rng(drive.command.times.size)
    z, held = of.values(of.start)[None], replace(drive, command=got)
    rows = {stream: values[..., 0]
            for stream, values in predicted(of, held, z, moved(of, held, z)).items()}
    return replace(drive, bins={stream: replace(bins, values=rows[stream] + 0.003 * (
        rng.standard_normal(rows[stream].shape))) for stream, bins in drive.bins.items()})


def fitted(*found: Drive) -> RecordingFits:
    """Return fits of some drives that are where their robot is."""
    of = base()
    noise = first_noise(of.settings).among({'left', 'right', 'yaw'})
    return RecordingFits(of, Prior(of.start, of.sd, np.ones(of.start.size, dtype=bool)), noise,
                         of.start, {drive.recording: of.start for drive in found}, (), found)


def test_ticks_are_found_by_the_wheels_of_both_sets(pool: Threads) -> None:
    """At one rate, each recording with its own phase."""
    one, other = sent(1), sent(2)
    true = [at_ticks(drive.command, PERIOD, phase)
            for drive, phase in ((one, 0.02), (other, 0.05))]
    found = at_own_ticks(fitted(*map(driven, (one, other), true)), pool)
    assert found is not None
    for drive, ticked in zip(found, true, strict=True):
        near = np.abs(drive.command.times[:, None] - ticked.times).min(axis=1)
        assert np.quantile(near, 0.9) < 0.003
        assert drive.command.times.size == pytest.approx(ticked.times.size, abs=3)


def test_a_base_that_takes_commands_as_they_come_gets_these(pool: Threads) -> None:
    one = sent(3)
    assert at_own_ticks(fitted(driven(one, one.command)), pool) is None


def test_robots_side_by_side_get_commands_of_their_own() -> None:
    """More of them than go together, to the bits that each has alone."""
    one, of = sent(4), base()
    commands = [at_ticks(one.command, 0.03 + 0.005 * k, 0.0) for k in range(20)]
    together = residuals(of, one, 20 * [of.start], commands)
    for got, left in zip(commands, together, strict=True):
        alone = residual(of, replace(one, command=got), of.start)
        for stream, rows in alone.items():
            np.testing.assert_array_equal(left[stream], rows)
    assert not np.array_equal(together[0]['wheels'], together[19]['wheels'])
    # Clocks are tried in as many as that.
    assert setting('clock_batch') == of.settings.simulation['lanes']


def test_of_two_fits_the_one_counts_that_leaves_less() -> None:
    """Fits with other commands may end on a worse optimum."""
    one = sent(5)
    there = fitted(driven(one, one.command))
    elsewhere = np.array(there.common)
    elsewhere[there.base.names.index('viscous_left')] += 0.5
    off = replace(there, places={one.recording: elsewhere})
    assert likelier(there, off) is there
    assert likelier(off, there) is there
