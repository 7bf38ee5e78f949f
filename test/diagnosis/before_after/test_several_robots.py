# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Robots that are simulated side by side do what each would do alone."""

from __future__ import annotations

from dataclasses import replace
import os
from pathlib import Path
import subprocess
import sys

from lg_husky_sim.diagnosis.before_after.base import Base, base_of
from lg_husky_sim.diagnosis.before_after.drives import Drive, drives
from lg_husky_sim.diagnosis.before_after.fitting import costs_at, Prior
from lg_husky_sim.diagnosis.before_after.motion import Memory, moved, side_by_side
from lg_husky_sim.diagnosis.before_after.prediction import jacobian, predicted, residual, residuals
from lg_husky_sim.diagnosis.before_after.settings import settings
from lg_husky_sim.diagnosis.before_after.whitening import first_noise
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.jit import compiled, SWITCH
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np
import pytest


def base(given: bool = False) -> Base:
    """Return the base with what a nominal robot has not, too."""
    found = base_of(settings(), load_model().parameters, given)
    start = np.array(found.start)
    for name, value in (('dead_voltage', 0.4), ('bus_resistance', 0.1), ('droop_rate', 0.001),
                        ('drag', 3.0), ('pull', 1.0), ('scrub', 1.0), ('slope_x', 0.2),
                        ('current_limit', np.log(6.0)), ('voltage_limit', np.log(12.0))):
        start[found.names.index(name)] = value
    return replace(found, start=start)


def drive() -> Drive:
    """Return a stretch in which limits are reached, with all sensors."""
    rng = np.random.default_rng(4)
    times = np.arange(0.0, 6.0, 0.05)
    held = np.repeat(rng.uniform(-1.2, 1.2, (10, 2)), 12, axis=0)
    held[50:60] = 0.0

    def stream(hertz: float, *names: str) -> TimeSeries:
        at = np.arange(0.0, 6.0, 1.0 / hertz)
        return TimeSeries(at, np.cumsum(0.05 * rng.standard_normal((at.size, len(names))), axis=0),
                          names)
    streams = {'command': TimeSeries(times, held, ('forward', 'yaw')),
               'wheels': stream(50.0, 'left', 'right'),
               'imu': stream(100.0, 'yaw_rate', 'accel_x', 'accel_y'),
               'pose': stream(20.0, 'x', 'y', 'heading')}
    known = settings()
    (found,) = drives(Recording('rec1', 'rec1', streams, 0), known.simulation['step'],
                      known.bins, 0.5, 3.0)
    return found


def places(of: Base, count: int) -> list[FloatArray]:
    """Return so many places about the start."""
    rng, lower, upper = np.random.default_rng(count), *of.bounds()
    return [np.clip(of.start + 0.2 * of.sd * rng.standard_normal(of.sd.size), lower, upper)
            for _ in range(count)]


def motions() -> FloatArray:
    """Return what a robot alone and two do, at the measured wheel rates and by the loop."""
    one = drive()
    return np.array([moved(base(given), one, np.array([base().values(z) for z in places(
        base(), count)]))[..., :count].sum(axis=(0, 2)) for given in (True, False)
        for count in (1, 2)])


@pytest.mark.parametrize('given', [False, True])
@pytest.mark.parametrize('count', [2, 16, 19])
def test_each_has_the_bits_that_it_has_alone(given: bool, count: int) -> None:
    of, one = base(given), drive()
    assert side_by_side(of) == 16
    at = places(of, count)
    together = residuals(of, one, at)
    assert len(together) == count
    for z, rows in zip(at, together, strict=True):
        alone = residual(of, one, z)
        assert set(rows) == set(alone) == {'imu', 'pose', *(() if given else ('wheels',))}
        assert all(np.array_equal(rows[name], alone[name]) for name in rows)
    assert not np.array_equal(together[0]['pose'], together[-1]['pose'])


@pytest.mark.parametrize('given', [False, True])
def test_a_derivative_is_the_quotient_of_two_robots_alone(given: bool) -> None:
    of, one = base(given), drive()
    (z,) = places(of, 1)
    free = np.array([not given or q.name in of.settings.body for q in of.settings.quantities])
    rows, columns = jacobian(of, one, z, free)
    here = residual(of, one, z)
    for k, quantity in enumerate(of.settings.quantities):
        near = np.array(z)
        near[k] += quantity.delta
        there = residual(of, one, near)
        for name in here:
            assert np.array_equal(rows[name], here[name])
            wanted = (there[name] - here[name]) / quantity.delta * free[k]
            if quantity.name != ('wheels_late' if given else 'dead_time'):
                assert np.allclose(columns[name][:, :, k], wanted, rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize('given', [False, True])
def test_a_clock_has_no_zero(given: bool) -> None:
    """A log that is later as a whole reads the same; a shift of the motion is as simulated."""
    of, one = base(given), drive()
    alike: dict[str, list[float]] = {}
    for z in places(of, 4):
        columns = jacobian(of, one, z, np.ones(z.size, dtype=np.bool_))[1]
        clock, delta = of.names.index('wheels_late' if given else 'dead_time'), 1e-3
        near = np.where(np.arange(z.size) == clock, z + delta, z)
        here, there = residual(of, one, z), residual(of, one, near)
        delays = [of.names.index(f'{stream}_late') for stream in ('pose', 'imu', 'wheels')]
        for name, column in columns.items():
            wanted = (there[name] - here[name]) / delta
            found = column[:, :, clock]
            alike.setdefault(name, []).append(float(
                np.vdot(found, wanted) / (np.linalg.norm(found) * np.linalg.norm(wanted))))
            whole = column[:, :, delays].sum(axis=2) - (0.0 if given else column[:, :, clock])
            by_gyro = name == 'pose'
            assert np.allclose(whole[:, :2] if by_gyro else whole, 0.0, atol=1e-12)
    # What a drive begins with does not shift, which is more of it at one place than at another.
    assert all(np.mean(one) > 0.9 for one in alike.values())


def test_costs_are_those_of_each_place() -> None:
    of, one = base(), drive()
    at = places(of, 5)
    prior = Prior(of.start, of.sd, np.ones(of.sd.size, dtype=np.bool_))
    noise = first_noise(of.settings)

    def cost(several: list[FloatArray]) -> list[float]:
        return costs_at(of, [one, one], prior, noise, several, map)
    assert cost(at) == [cost([z])[0] for z in at]
    assert len(set(cost(at))) == 5


def test_what_is_only_read_otherwise_shares_a_motion() -> None:
    of, one = base(), drive()
    robots = np.array([of.values(of.start)] * 3)
    robots[1, of.names.index('imu_late')] = 0.05
    robots[2, of.names.index('wheels_window')] = 0.2
    shared = predicted(of, one, robots, moved(of, one, robots[:1]))
    for k, robot in enumerate(robots):
        own = predicted(of, one, robot[None], moved(of, one, robot[None]))
        assert all(np.array_equal(shared[name][..., k], own[name][..., 0]) for name in own)


@pytest.mark.skipif(not compiled(), reason='numba is not installed: there is one kernel only')
def test_plain_python_does_the_same_and_reads_nothing_beyond_the_arrays(tmp_path: Path) -> None:
    """Machine code would read whatever memory is there."""
    script = f"""
import sys
sys.path.insert(0, {str(Path(__file__).parent)!r})
import numpy as np
from test_several_robots import motions
np.save({str(tmp_path / 'plain.npy')!r}, motions())
"""
    subprocess.run([sys.executable, '-c', script], check=True, timeout=120,
                   env={**os.environ, SWITCH: '1'})
    np.testing.assert_array_equal(np.load(tmp_path / 'plain.npy'), motions())


def test_memory_is_used_again_and_grows() -> None:
    memory = Memory()
    first = memory.rows(3, 2)
    assert np.shares_memory(first, memory.rows(2, 3))
    assert memory.rows(4, 2).shape == (4, 2)
    assert not np.shares_memory(first, memory.rows(4, 2))
