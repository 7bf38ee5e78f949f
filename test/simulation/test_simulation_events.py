# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Commands at any stamps and times at any spacing: the event-driven drive and its boundaries."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.errors import ParameterError
from lg_husky_sim.husky.effects import Effect, Onset, OnsetKind
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import BodyTwist, FloatArray, Pose, TimeSeries
from lg_husky_sim.simulation import rollout
from lg_husky_sim.simulation.events import COLUMNS, Events, Propagator, trajectory
from lg_husky_sim.simulation.modes import modes_of
import numpy as np
import pytest
import scipy.linalg

Maker = Callable[..., Plant]


def series(stamps: list[float] | FloatArray, values: list[list[float]] | FloatArray
           ) -> TimeSeries:
    """Return commands."""
    return TimeSeries(np.asarray(stamps, dtype=np.float64),
                      np.asarray(values, dtype=np.float64), ('forward', 'yaw'))


def drive(seed: int = 1, count: int = 40, longest: float = 0.2) -> TimeSeries:
    """Return commands at stamps that fall on no grid."""
    draws = np.random.default_rng(seed)
    stamps = np.cumsum(draws.uniform(0.0, longest, count))
    return series(stamps, draws.uniform(-0.8, 0.8, (count, 2)))


def wanted(commands: TimeSeries, count: int = 200, seed: int = 2) -> FloatArray:
    """Return times at no grid either, sorted."""
    draws = np.random.default_rng(seed)
    times: FloatArray = np.sort(draws.uniform(commands.times[0], commands.times[-1], count))
    return times


@pytest.mark.parametrize('effects', [
    (), ('belt_compliance',), ('speed_loop',), ('command_slew',), ('rolling_resistance',),
    ('coulomb_drivetrain', 'yaw_scrub_coulomb'), ('gear_backlash',), ('motor_heating',)])
def test_a_time_does_not_move_for_others(robot: Maker, effects: tuple[str, ...]) -> None:
    """Output at some times is the same, whatever else is asked for."""
    plant, commands = robot(*effects), drive()
    many = wanted(commands)
    whole = trajectory(plant, commands, many)
    few = trajectory(plant, commands, many[::17])
    bound = np.full(len(COLUMNS), 2e-6)
    bound[[4, 5, 6, 13, 14]] = 1e-4  # amperes, m/s² and volts
    assert np.all(np.abs(few.values - whole.values[::17]).max(axis=0) < bound)


@pytest.mark.parametrize('effects', [(), ('belt_compliance',), ('payload',)])
def test_on_a_grid_it_is_the_exact_hold(robot: Maker, effects: tuple[str, ...]) -> None:
    plant = robot(*effects)
    commands = series(np.linspace(0.0, 1.9, 20), drive(3, 20).values)
    stepped = rollout(plant, commands, 2.0, 0.02, pose=Pose(1.0, 2.0, 0.5))
    # A copy: read-only times are another type to numba, which would compile for it alone.
    free = trajectory(plant, commands, stepped.times[1:].copy(), pose=Pose(1.0, 2.0, 0.5))
    np.testing.assert_allclose(free.values[:, :11], stepped.values[1:, :11], rtol=0, atol=1e-9)
    np.testing.assert_allclose(free.values[:, 11:13], stepped.values[1:, 11:13], rtol=0,
                               atol=1e-7)


def test_a_dead_time_of_any_length_shifts_the_drive_exactly(robot: Maker) -> None:
    commands = drive()
    times = wanted(commands)
    plain = trajectory(robot(), commands, times, start=0.0)
    for latency in (1e-5, 0.0371, 1.2):
        late = trajectory(robot('command_latency', latency=latency), commands,
                          times + latency, start=0.0)
        np.testing.assert_allclose(late.values, plain.values, rtol=0, atol=1e-8)


def test_a_ramp_ends_where_it_should(robot: Maker) -> None:
    """Slew 0.3 m/s²: the voltage is a straight line until 0.25 m/s are reached."""
    plant = robot(Effect('command_slew', shape='forward'), slew_forward=0.3)
    commands = series([0.1], [[0.25, 0.0]])
    times = np.array([0.1 + 0.2, 0.1 + 0.25 / 0.3, 2.0])
    seen = trajectory(plant, commands, times, start=0.0).column('voltage_left')
    full = 24.0 * 0.8961 * 0.25
    np.testing.assert_allclose(seen, [full * 0.06 / 0.25, full, full], rtol=1e-12)


def test_a_fast_ramp_only_rounds_the_corners(robot: Maker) -> None:
    """At the bounds of the catalogue a ramp is over within 20 ms, and nothing else is changed."""
    fast = robot('command_slew', slew_forward=50.0, slew_yaw=100.0)
    commands = series([0.0, 1.0], [[0.6, 0.3], [0.2, -0.5]])
    times = np.array([0.011, 0.5, 1.0, 1.02, 1.5])
    ramped, plain = (trajectory(one, commands, times).column('voltage_left')
                     for one in (fast, robot()))
    np.testing.assert_allclose(ramped[1:], plain[1:], rtol=1e-12)
    assert 0.5 * plain[0] < ramped[0] < plain[0]


def test_a_ramp_through_the_clamp_is_cut_off_exactly(robot: Maker) -> None:
    plant = robot(Effect('command_slew', shape='forward'), slew_forward=1.0)
    commands = series([0.0, 3.0], [[3.0, 0.0], [-3.0, 0.0]])
    reached = 1.0 / 0.8961
    times = np.sort(np.append(np.linspace(0.0, 9.0, 200), [reached, 3.0 + 3.0 - reached]))
    seen = trajectory(plant, commands, times).column('voltage_right')
    command = np.clip(np.where(times < 3.0, times, 6.0 - times), -3.0, 3.0)
    np.testing.assert_allclose(seen, np.clip(24.0 * 0.8961 * command, -24.0, 24.0), atol=1e-8)


def test_an_onset_at_a_time_is_where_it_says(robot: Maker) -> None:
    """Until then the plain robot; the heavier one continues from its state."""
    commands, begin = drive(), 1.7183
    plant = robot(Effect('payload', late=True), onset=Onset(OnsetKind.TIME, begin),
                  payload_mass=40.0)
    times = wanted(commands)
    seen = trajectory(plant, commands, times).values
    plain = trajectory(robot(), commands, times).values
    before = times < begin
    np.testing.assert_allclose(seen[before], plain[before], rtol=0, atol=1e-8)
    after = np.flatnonzero(~before)[3]
    assert np.abs(seen[after] - plain[after]).max() > 1e-3


@pytest.mark.parametrize('kind', [OnsetKind.PLACE_ABOVE, OnsetKind.PLACE_BELOW])
def test_a_place_is_found_between_the_times(robot: Maker, kind: OnsetKind) -> None:
    """Crossed where the plain robot is there, to a nanosecond; asked for at few times or many."""
    sign = 1.0 if kind is OnsetKind.PLACE_ABOVE else -1.0
    commands = series([0.0], [[0.6 * sign, 0.1]])
    plain = trajectory(robot(), commands, np.linspace(0.0, 3.0, 30001))
    place = sign * 0.7
    moment = np.interp(0.7, sign * plain.column('x'), plain.times)
    plant = robot(Effect('payload', late=True), onset=Onset(kind, place), payload_mass=40.0)
    at_time = robot(Effect('payload', late=True), onset=Onset(OnsetKind.TIME, float(moment)),
                    payload_mass=40.0)
    for times in (np.array([3.0]), np.linspace(0.0, 3.0, 77)):
        seen, same = (trajectory(one, commands, times) for one in (plant, at_time))
        np.testing.assert_allclose(seen.values, same.values, rtol=0, atol=2e-6)
    assert not np.allclose(seen.values[-1], plain.values[-1], rtol=0, atol=1e-4)


@pytest.mark.parametrize('effect', ['payload', 'coulomb_drivetrain'])
def test_legs_say_when_the_second_set_acts(robot: Maker, effect: str) -> None:
    """Beyond a place by turns: as often as the robot crosses it, whatever its onset says."""
    commands = series([0.0, 2.0, 4.0], [[0.7, 0.1], [-0.7, 0.1], [0.7, 0.0]])
    times, place = np.sort(np.append(np.linspace(0.0, 6.0, 301), [1.234567, 4.9])), 0.5
    numbers = {'payload_mass': 40.0} if effect == 'payload' else {'dry_torque': 4.0}
    plant = robot(Effect(effect, late=True), onset=Onset(OnsetKind.PLACE_ABOVE, place), **numbers)
    seen = trajectory(plant, commands, times)
    fine = trajectory(plant, commands, np.linspace(0.0, 6.0, 60001))
    x = fine.column('x') - place
    before = np.flatnonzero((x[1:] >= 0.0) != (x[:-1] >= 0.0))
    turns = fine.times[before] - x[before] * 1e-4 / (x[before + 1] - x[before])
    assert turns.size == 3
    legs = [(float(end), bool(k % 2)) for k, end in enumerate([*turns, np.inf])]
    elsewhere = Propagator(robot(Effect(effect, late=True), onset=Onset(
        OnsetKind.PLACE_BELOW, -9.0), **numbers))
    events = Events(commands, times)
    told = elsewhere.run(events, elsewhere.initial(), legs=legs)
    np.testing.assert_allclose(told, seen.values, rtol=0, atol=1e-5)
    never = elsewhere.run(events, elsewhere.initial())
    assert np.max(np.abs(told - never)) > 0.05


def test_what_was_in_force_before_the_first_command_counts(robot: Maker) -> None:
    commands = series([1.0], [[0.0, 0.0]])
    driven = trajectory(robot(), commands, [0.999, 1.5], start=0.0,
                        command=BodyTwist(0.5, 0.0)).column('forward')
    assert driven[0] > 0.2 > driven[1]


def test_events_serve_many_plants_and_any_order(robot: Maker) -> None:
    commands = drive()
    times = wanted(commands)[::-1]
    events = Events(commands, times)
    for mass in (0.0, 20.0):
        propagator = Propagator(robot('payload', payload_mass=mass))
        seen = propagator.run(events, propagator.initial())
        again = trajectory(propagator.plant, commands, times[::-1]).values
        np.testing.assert_array_equal(seen, again[::-1])
        assert seen.shape == (times.size, len(COLUMNS))


@pytest.mark.parametrize(('times', 'start', 'words'), [
    ([0.5], 1.0, 'lies before start'), ([np.nan], 1.0, 'must be finite')])
def test_times_that_cannot_be_are_refused(robot: Maker, times: list[float], start: float,
                                          words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        trajectory(robot(), drive(), times, start=start)
    nothing = TimeSeries(np.zeros(0), np.zeros((0, 2)), ('forward', 'yaw'))
    with pytest.raises(ParameterError, match='no command to start at'):
        trajectory(robot(), nothing, [1.0])


@pytest.mark.parametrize('matrix', [
    [[-2.0, 1.0], [0.0, -2.0]], [[0.0, 1.0], [0.0, 0.0]], [[-1.0, 50.0], [-50.0, -1.0]],
    [[-3.0, 0.0, 1.0], [0.0, -3.0, 0.0], [0.0, 0.0, -1000.0]]])
def test_modes_rebuild_a_matrix_even_without_enough_eigenvectors(
        matrix: list[list[float]]) -> None:
    a = np.array(matrix)
    modes = modes_of(a)
    turned = scipy.linalg.block_diag(
        np.diag(modes.rates[:modes.n_real]) if modes.n_real else np.zeros((0, 0)))
    size = modes.rates.size
    whole = np.zeros((size, size))
    whole[:modes.n_real, :modes.n_real] = turned
    for k in range(modes.n_real, modes.n_real + modes.n_pairs):
        m = k + modes.n_pairs
        whole[[k, m], [k, m]] = modes.rates[k]
        whole[m, k], whole[k, m] = modes.rates[m], -modes.rates[m]
    np.testing.assert_allclose(modes.out_of @ modes.into, np.eye(len(a)), atol=1e-9)
    np.testing.assert_allclose(modes.out_of @ whole @ modes.into, a, rtol=0,
                               atol=1e-8 * np.abs(a).max())


def test_times_that_nobody_may_write_are_of_the_type_that_is_compiled() -> None:
    """An array that is read-only would have the kernel compiled a second time."""
    times = np.linspace(0.0, 1.0, 5)
    times.flags.writeable = False
    events = Events(drive(), times, start=0.0)
    assert events.times.flags.writeable
    np.testing.assert_array_equal(events.times, times)
