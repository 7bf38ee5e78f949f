# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""One stepping function for live and for replay; holding, shaping and adopting."""

from __future__ import annotations

from collections.abc import Callable
import os
from pathlib import Path
import subprocess
import sys

from lg_husky_sim.errors import ParameterError
from lg_husky_sim.husky.model import compile_model, Drivetrain, Structure
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.identification.options import with_effects
from lg_husky_sim.jit import compiled, SWITCH
from lg_husky_sim.signals import BodyTwist, FloatArray, Pose, TimeSeries
from lg_husky_sim.simulation import rollout, Simulator
from lg_husky_sim.simulation.events import COLUMNS, trajectory
from lg_husky_sim.simulation.simulator import hold
import numpy as np
from numpy.typing import ArrayLike
import pytest

Maker = Callable[..., Plant]

MANY = ('battery_sag', 'coulomb_drivetrain', 'torque_ripple', 'gear_backlash', 'motor_heating',
        'traction_saturation', 'yaw_scrub_coulomb', 'slope', 'command_latency', 'command_slew')


def wandering(count: int, seed: int = 0) -> FloatArray:
    """Return commands that change every 0.2 s at 50 Hz."""
    generator = np.random.default_rng(seed)
    few: FloatArray = generator.uniform(-0.9, 0.9, (-(-count // 10), 2))
    return np.repeat(few, 10, axis=0)[:count]


def series(times: ArrayLike, values: FloatArray) -> TimeSeries:
    return TimeSeries(np.asarray(times, dtype=np.float64), values, ('forward', 'yaw'))


@pytest.mark.parametrize('effects', [(), ('speed_loop',), MANY])
def test_live_steps_are_the_replay_bit_for_bit(robot: Maker, effects: tuple[str, ...]) -> None:
    plant, commands = robot(*effects), wandering(120)
    simulator = Simulator(plant, 0.02)
    start = simulator.initial(Pose(1.0, 2.0, 0.3), BodyTwist(0.3, -0.2))
    state, rows = start, []
    for forward, yaw in commands:
        state = simulator.step(state, BodyTwist(float(forward), float(yaw)))
        rows.append(state.row)
    end, out = simulator.run(start, commands)
    np.testing.assert_array_equal(out, np.array(rows))
    np.testing.assert_array_equal(end.flat, state.flat)
    half, first = simulator.run(start, commands[:50])
    _, second = simulator.run(half, commands[50:])
    np.testing.assert_array_equal(np.vstack([first, second]), out)


def test_rollout_is_the_trajectory_at_its_grid(robot: Maker) -> None:
    """Commands at any stamps count at those stamps: nothing is averaged over a step."""
    plant = robot(*MANY)
    generator = np.random.default_rng(5)
    times = np.cumsum(generator.uniform(0.01, 0.2, 40))
    commands = series(times, generator.uniform(-1.0, 1.0, (40, 2)))
    start = float(times[0])
    run = rollout(plant, commands, 4.0, 0.02, pose=Pose(1.0, 2.0, 3.0))
    free = trajectory(plant, commands, run.times[1:], pose=Pose(1.0, 2.0, 3.0))
    assert run.names == COLUMNS
    np.testing.assert_array_equal(run.values[1:], free.values)
    np.testing.assert_allclose(run.times, start + 0.02 * np.arange(len(run)), atol=1e-12)


def test_commands_on_the_grid_are_steps(robot: Maker) -> None:
    plant, values = robot(), wandering(100)
    run = rollout(plant, series(0.02 * np.arange(100), values), 2.0, 0.02)
    simulator = Simulator(plant, 0.02)
    _, out = simulator.run(simulator.initial(), values)
    np.testing.assert_allclose(run.values[1:], out, rtol=0, atol=1e-9)


def test_a_step_leaves_its_state_alone_and_names_agree(robot: Maker) -> None:
    simulator = Simulator(robot(), 0.02)
    start = simulator.initial(Pose(1.0, 2.0, 0.5), BodyTwist(0.4, 0.3), time=7.0,
                              wheel_angles=(3.0, 4.0))
    before = start.flat.copy()
    state = simulator.step(start, BodyTwist(0.8, -0.2))
    np.testing.assert_array_equal(start.flat, before)
    with pytest.raises(ValueError, match='read-only'):
        state.flat[0] = 1.0
    named = dict(zip(COLUMNS, state.row, strict=True))
    assert state.time == pytest.approx(7.02)
    assert state.twist == BodyTwist(named['forward'], named['yaw_rate'])
    assert state.pose == Pose(named['x'], named['y'], named['heading'])
    assert state.wheel_angles == (named['angle_left'], named['angle_right'])
    assert state.wheel_rates == (named['wheel_left'], named['wheel_right'])
    assert state.currents == (named['current_left'], named['current_right'])
    assert state.voltages == (named['voltage_left'], named['voltage_right'])
    assert state.distance == named['distance']
    assert state.acceleration == named['accel_x']


def test_initial_twist_is_what_rolls(robot: Maker) -> None:
    """A given twist is taken exactly; wheels are those of that twist's steady drive."""
    for effects in ((), ('belt_compliance',), ('speed_loop',)):
        simulator = Simulator(robot(*effects), 0.001)
        state = simulator.initial(twist=BodyTwist(0.5, 0.4))
        assert state.twist == BodyTwist(0.5, 0.4)
        steady, _ = Simulator(robot(), 0.02).run(
            Simulator(robot(), 0.02).initial(), np.tile([0.5 / 1.0140089, 0.4 / 1.0075859],
                                                        (600, 1)))
        assert state.wheel_rates == pytest.approx(steady.wheel_rates, rel=1e-5)
        after = simulator.step(state, BodyTwist(0.5, 0.4))
        assert after.twist.forward == pytest.approx(0.5, abs=0.01)
        assert after.twist.yaw == pytest.approx(0.4, abs=0.01)


@pytest.mark.parametrize('period', [0.0, -0.02, float('nan'), float('inf')])
def test_period_must_be_positive(robot: Maker, period: float) -> None:
    with pytest.raises(ParameterError, match=r'period = .* is not a positive number'):
        Simulator(robot(), period)


def test_hold_averages_each_step() -> None:
    """Against a fine Riemann sum of the staircase, with stamps anywhere, before and after."""
    generator = np.random.default_rng(2)
    times = np.sort(generator.integers(1000, 3000, 30)) * 1e-3
    values = generator.uniform(-1.0, 1.0, (30, 2))
    held = hold(series(times, values), 0.5, 0.05, 60)
    middle = 0.5 + (np.arange(3000) + 0.5) * 1e-3
    last = np.searchsorted(times, middle, side='right') - 1
    stairs = np.where(last[:, None] >= 0, values[np.maximum(last, 0)], 0.0)
    np.testing.assert_allclose(held, stairs.reshape(60, 50, 2).mean(axis=1), atol=1e-10)
    assert not np.any(held[:9])  # nothing is commanded before the first stamp
    np.testing.assert_allclose(held[-1], values[-1], atol=1e-12)  # the last one stays


def test_hold_of_nothing_and_of_one() -> None:
    assert not np.any(hold(series(np.zeros(0), np.zeros((0, 2))), 0.0, 0.02, 4))
    one = hold(series(np.array([0.03]), np.array([[1.0, -2.0]])), 0.0, 0.02, 3)
    np.testing.assert_allclose(one, [[0.0, 0.0], [0.5, -1.0], [1.0, -2.0]], atol=1e-12)


def shaped(plant: Plant, commands: FloatArray, period: float = 0.02) -> FloatArray:
    """Return the (forward, yaw) that reached the voltages."""
    simulator = Simulator(plant, period)
    _, out = simulator.run(simulator.initial(), commands)
    stage = plant.sets[0].command
    left, right = out[:, 13], out[:, 14]
    return np.column_stack([(left + right) / (2.0 * stage.volts_per_speed),
                            (right - left) / (2.0 * stage.volts_per_rate)])


def test_a_dead_time_ends_between_two_steps(robot: Maker) -> None:
    """What reaches the voltages at the end of a step was commanded a dead time before."""
    commands = 0.6 * wandering(60)
    for steps in (0.0, 1.0, 2.5, 7.25):
        got = shaped(robot('command_latency', latency=0.02 * steps), commands)
        asked = np.ceil(np.arange(1, 61) - steps - 1e-9).astype(int) - 1
        expected = np.where(asked[:, None] >= 0, commands[np.maximum(asked, 0)], 0.0)
        np.testing.assert_allclose(got, expected, atol=1e-12)


def test_no_dead_time_is_too_long_for_a_period(robot: Maker) -> None:
    plant = robot('command_latency', latency=1.0)
    commands = np.tile([0.5, 0.0], (1200, 1))
    for period in (0.01, 0.001):
        got = shaped(plant, commands, period)[:, 0]
        last = round(1.0 / period)
        assert np.all(got[:last - 1] == 0.0)
        np.testing.assert_allclose(got[last + 1:], 0.5, rtol=1e-12)


def test_slew_and_limit(robot: Maker) -> None:
    slow = shaped(robot('command_slew', slew_forward=0.5, slew_yaw=1.0),
                  np.tile([0.4, -0.6], (80, 1)))
    ramp = 0.02 * np.arange(1, 81)
    np.testing.assert_allclose(slow[:, 0], np.minimum(0.5 * ramp, 0.4), atol=1e-12)
    np.testing.assert_allclose(slow[:, 1], np.maximum(-1.0 * ramp, -0.6), atol=1e-12)
    commands = 0.6 * wandering(60)
    limited = shaped(robot('command_limit', limit_yaw=0.3), commands)
    np.testing.assert_allclose(limited[:, 1], np.clip(commands[:, 1], -0.3, 0.3), atol=1e-12)
    np.testing.assert_allclose(limited[:, 0], commands[:, 0], atol=1e-12)


def test_adopting_another_plant_does_not_jump(robot: Maker) -> None:
    simulator = Simulator(robot(), 0.02)
    state, _ = simulator.run(simulator.initial(Pose(1.0, 2.0, 0.5), time=3.0),
                             np.tile([0.5, 0.4], (200, 1)))
    for effects in (('rolling_resistance',), ('speed_loop',), ('belt_compliance',)):
        other = Simulator(robot(*effects), 0.001)
        adopted = other.adopt(state)
        for name in ('pose', 'twist', 'wheel_rates', 'wheel_angles', 'time', 'distance'):
            assert getattr(adopted, name) == getattr(state, name), name
        after = other.step(adopted, BodyTwist(0.5, 0.4))
        assert after.twist.forward == pytest.approx(state.twist.forward, abs=1e-3), effects
        assert after.twist.yaw == pytest.approx(state.twist.yaw, abs=1e-3), effects
        assert after.wheel_rates == pytest.approx(state.wheel_rates, abs=0.03), effects
        assert after.currents == pytest.approx(state.currents, abs=0.5), effects
        assert after.pose.x == pytest.approx(state.pose.x, abs=1e-3)
        assert after.time == pytest.approx(state.time + 0.001)
        back = simulator.adopt(adopted)
        assert back.twist.forward == pytest.approx(state.twist.forward)
        assert back.pose == state.pose


def test_as_many_states_need_not_be_the_same_ones() -> None:
    """A speed loop has as many as the expanded drivetrain has more."""
    nominal = load_model()
    looped = with_effects(nominal, ['speed_loop'])
    one = compile_model(looped.structure).at(looped.parameters)
    other = compile_model(Structure(Drivetrain.EXPANDED)).at(nominal.parameters)
    assert len(one.states) == len(other.states)
    state, _ = Simulator(one, 0.02).run(Simulator(one, 0.02).initial(),
                                        np.tile([0.5, 0.0], (200, 1)))
    exchanged = Simulator(other, 0.001)
    after = exchanged.step(exchanged.adopt(state), BodyTwist(0.5, 0.0))
    assert after.twist.forward == pytest.approx(state.twist.forward, abs=1e-3)


def test_adopting_the_same_plant_changes_nothing(robot: Maker) -> None:
    plant, commands = robot(*MANY), wandering(100)
    first, second = Simulator(plant, 0.02), Simulator(robot(*MANY), 0.02)
    middle, _ = first.run(first.initial(), commands[:50])
    _, out = second.run(second.adopt(middle), commands[50:])
    _, whole = first.run(first.initial(), commands)
    np.testing.assert_array_equal(out, whole[50:])


SCRIPT = """
import sys
import importlib.util
import numpy as np
from lg_husky_sim.jit import compiled
from lg_husky_sim.simulation import Simulator
assert not compiled()
spec = importlib.util.spec_from_file_location('robots', sys.argv[1])
robots = importlib.util.module_from_spec(spec)
spec.loader.exec_module(robots)
commands = np.load(sys.argv[2])
runs = []
for names in sys.argv[4:]:
    simulator = Simulator(robots._robot(*names.split()), 0.02)
    runs.append(simulator.run(simulator.initial(), commands)[1])
np.save(sys.argv[3], np.array(runs))
"""


@pytest.mark.skipif(not compiled(), reason='numba is not installed: there is one kernel only')
def test_compiled_and_plain_kernels_agree(robot: Maker, tmp_path: Path) -> None:
    """Bit for bit: every operation is IEEE, in the order in which it is written."""
    sets = ('', 'speed_loop', ' '.join(MANY))
    commands = wandering(100)
    np.save(tmp_path / 'commands.npy', commands)
    subprocess.run(
        [sys.executable, '-c', SCRIPT, str(Path(__file__).parents[1] / 'conftest.py'),
         str(tmp_path / 'commands.npy'), str(tmp_path / 'plain.npy'), *sets],
        check=True, env={**os.environ, SWITCH: '1'}, timeout=120)
    plain = np.load(tmp_path / 'plain.npy')
    for names, rows in zip(sets, plain, strict=True):
        simulator = Simulator(robot(*names.split()), 0.02)
        _, out = simulator.run(simulator.initial(), commands)
        np.testing.assert_array_equal(out, rows)
