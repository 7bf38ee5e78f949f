# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The live twin's arithmetic, without a graph: the true model of any effect has the smaller error.

The robot is a simulation that is sampled with the robot's own angles, heading and delays; it has
driven for a while before anybody listens.
"""

from __future__ import annotations

from collections.abc import Callable
import math

from lg_husky_sim.husky.effects import Effect, Onset, OnsetKind
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.ros.engine import Engine
from lg_husky_sim.ros.settings import make_settings
from lg_husky_sim.ros.shadow import PERIOD, Shadow
from lg_husky_sim.ros.stamp_clock import StampClock
from lg_husky_sim.signals import BodyTwist, Pose
from lg_husky_sim.simulation import Simulator
import pytest

Maker = Callable[..., Plant]


def commanded(moment: float) -> BodyTwist:
    """Return a drive that goes on and on: ahead, a turn, back."""
    phase = moment % 8.0
    return BodyTwist(0.6, 0.0) if phase < 3.0 else BodyTwist(0.3, 0.6) if phase < 6.0 else (
        BodyTwist(-0.5, 0.0))


def errors(truth: Plant, models: dict[str, Plant], *, late: float = 0.0, factor: float = 1.0,
           joined: float = 5.0, until: float = 25.0) -> dict[str, float]:
    """
    Drive a robot beside models, and return each one's overall error of the wheel rates [rad/s].

    Joint states come every second step, with stamps that are late by some time [s] and a left
    encoder with a factor; the models join after some seconds.
    """
    simulator = Simulator(truth, PERIOD)
    state = simulator.initial(Pose(1.0, -2.0, 0.8), wheel_angles=(2.0, 0.5))
    shadows = {name: Shadow(plant) for name, plant in models.items()}
    told = BodyTwist()
    steps = [(state.time, state)]
    for step in range(round(until / PERIOD)):
        moment = step * PERIOD
        wanted = commanded(moment)
        if wanted != told:
            told = wanted
            for shadow in shadows.values():
                shadow.command(moment, told)
        state = simulator.step(state, told)
        steps.append((state.time, state))
        if moment < joined or step % 2:
            continue
        past = steps[-1 - round(late / PERIOD)][1]
        for shadow in shadows.values():
            shadow.place(state.pose, correct=True)
            shadow.wheels(state.time + 1e-7, factor * past.wheel_rates[0], past.wheel_rates[1], (
                factor * past.wheel_angles[0], past.wheel_angles[1]))
    return {name: shadow.errors['wheel_rate'].overall for name, shadow in shadows.items()}


@pytest.mark.parametrize(('effect', 'values', 'sensed'), [
    (Effect('torque_ripple', 'both'), {'ripple_cos': 6.0, 'ripple_sin': 4.0}, {}),
    (Effect('slope'), {'slope_x': -60.0, 'slope_y': 30.0}, {}),
    (Effect('sensor_time_offset', shape='wheels'), {'stamp_delay': 0.2}, {'late': 0.2}),
    (Effect('encoder_scale', 'left'), {'encoder_factor': 0.9}, {'factor': 0.9}),
    (Effect('coulomb_drivetrain', 'both'), {'dry_torque': 3.0}, {}),
])
def test_the_true_model_has_the_smaller_live_error(
        robot: Maker, effect: Effect, values: dict[str, float], sensed: dict[str, float]) -> None:
    """Rows 22 and 33: with the true model of a slope or a ripple the error doubled."""
    model = robot(effect, **values)
    # Delays and factors belong to the sensors, which this test reads by itself.
    truth = robot() if sensed else model
    found = errors(truth, {'model': model, 'plain': robot()}, **sensed)
    assert found['model'] < 0.25 * found['plain']
    assert found['plain'] > 0.01


def test_an_effect_that_begins_at_a_place_begins_there_live(robot: Maker) -> None:
    """Row 33: its onset was ignored; the model knew the effect always or never."""
    onset = Onset(OnsetKind.PLACE_ABOVE, 0.85)
    model = robot(Effect('slope', late=True), onset=onset, slope_x=-80.0, slope_y=0.0)
    always = robot('slope', slope_x=-80.0, slope_y=0.0)
    found = errors(model, {'model': model, 'always': always, 'plain': robot()})
    assert found['model'] < 0.25 * min(found['always'], found['plain'])


@pytest.mark.parametrize(('effect', 'values', 'known'), [
    (Effect('torque_ripple', 'both'), {'ripple_cos': 6.0, 'ripple_sin': 4.0}, 'angles'),
    (Effect('slope'), {'slope_x': -60.0, 'slope_y': 30.0}, 'pose')])
def test_a_model_begins_as_the_robot_stands(
        robot: Maker, effect: Effect, values: dict[str, float], known: str) -> None:
    """Row 33: it began at pose 0 and wheel angle 0; neither is corrected here later on."""
    plant = robot(effect, **values)
    told, found = BodyTwist(0.5, 0.3), {}
    for missing in ('', known):
        truth, shadow = Simulator(plant, PERIOD), Shadow(plant)
        state = truth.initial(Pose(1.0, -2.0, 0.8), wheel_angles=(2.0, 0.5))
        for _ in range(300):
            state = truth.step(state, told)
        shadow.command(0.0, told)
        if missing != 'pose':
            shadow.place(state.pose)
        shadow.wheels(state.time, *state.wheel_rates,
                      state.wheel_angles if missing != 'angles' else None)
        for _ in range(30):
            state = truth.step(state, told)
            shadow.wheels(state.time + 1e-7, *state.wheel_rates)
        found[missing] = shadow.errors['wheel_rate'].overall
    assert found[''] < 0.5 * found[known]


def test_a_ripple_stays_in_phase_with_the_wheels(robot: Maker) -> None:
    """Row 33: JointState.position was not taken; a model that rolls a little less falls behind."""
    ripple = {'ripple_cos': 6.0, 'ripple_sin': 4.0}
    effect = Effect('torque_ripple', 'both')
    truth = Simulator(robot(effect, **ripple, wheel_damping=2.1), PERIOD)
    shadows = {known: Shadow(robot(effect, **ripple)) for known in (True, False)}
    state, told = truth.initial(), BodyTwist(0.6, 0.2)
    for shadow in shadows.values():
        shadow.command(0.0, told)
        shadow.wheels(0.0, 0.0, 0.0, (0.0, 0.0))
    for _ in range(2500):
        state = truth.step(state, told)
        for known, shadow in shadows.items():
            shadow.wheels(state.time + 1e-7, *state.wheel_rates,
                          state.wheel_angles if known else None)
    overall = {known: one.errors['wheel_rate'].overall for known, one in shadows.items()}
    assert overall[True] < 0.7 * overall[False]


@pytest.mark.parametrize(('effect', 'values', 'late', 'read'), [
    (Effect('sensor_time_offset', shape='imu'), {'stamp_delay': 0.2}, 20, lambda rate: rate),
    (Effect('gyro_scale'), {'gyro_factor': 0.8}, 0, lambda rate: 0.8 * rate),
    (Effect('gyro_bias'), {'gyro_bias': 0.05}, 0, lambda rate: rate + 0.05)])
def test_faults_of_the_gyro_are_in_what_a_model_reads(
        robot: Maker, effect: Effect, values: dict[str, float], late: int,
        read: Callable[[float], float]) -> None:
    """Row 33: delays and faults that were found did not act on the yaw rate."""
    truth = Simulator(robot(), PERIOD)
    shadows = [Shadow(robot(effect, **values)), Shadow(robot())]
    states, told = [truth.initial()], BodyTwist()
    for shadow in shadows:
        shadow.wheels(0.0, 0.0, 0.0, (0.0, 0.0))
    for step in range(1200):
        if commanded(step * PERIOD) != told:
            told = commanded(step * PERIOD)
            for shadow in shadows:
                shadow.command(step * PERIOD, told)
        states.append(truth.step(states[-1], told))
        if step > late:
            for shadow in shadows:
                shadow.gyro(states[-1].time + 1e-7, read(states[-1 - late].twist.yaw))
    found, plain = (shadow.errors['yaw_rate'].overall for shadow in shadows)
    assert found < 0.25 * plain
    assert plain > 0.01


def test_a_late_message_is_compared_with_its_own_moment(robot: Maker) -> None:
    """A command that overtakes a measurement on its way changes nothing about it."""
    plant = robot()
    shadow, truth = Shadow(plant), Simulator(plant, PERIOD)
    state = truth.initial()
    shadow.wheels(0.0, 0.0, 0.0, (0.0, 0.0))
    shadow.command(0.0, BodyTwist(0.8, 0.0))
    for _ in range(10):
        state = truth.step(state, BodyTwist(0.8, 0.0))
    shadow.command(0.3, BodyTwist(0.0, 0.0))
    shadow.wheels(0.1, *state.wheel_rates)
    assert shadow.errors['wheel_rate'].overall < 1e-6


def test_the_limits_of_the_robots_preset_act_on_the_models() -> None:
    """A Clearpath robot accelerates by 1 m/s² at most: its very model was off by 0.4 rad/s."""
    settings = make_settings(preset='clearpath_jazzy', rate=1.0 / PERIOD, command_timeout=0.255)
    engine = Engine(settings)
    shadows = {name: Shadow(Simulator(compile_model(load_model().structure).at(
        load_model().parameters), PERIOD).plant, one) for name, one in {
            'own': settings, 'free': make_settings(command_timeout=0.255)}.items()}
    for shadow in shadows.values():
        shadow.wheels(0.0, 0.0, 0.0, (0.0, 0.0))
    # The last one is forgotten while it is being obeyed.
    for forward, yaw, steps in ((0.5, 0.3, 100), (1.5, 0.0, 80), (-0.4, 1.5, 20), (0.3, 0.0, 80)):
        for step in range(steps):
            if forward > 0.3 or not step:
                engine.command(BodyTwist(forward, yaw))
                for shadow in shadows.values():
                    shadow.command(engine.state.time, BodyTwist(forward, yaw))
            engine.step()
            for shadow in shadows.values():
                shadow.wheels(engine.state.time + 1e-7, *engine.state.wheel_rates)
    assert shadows['own'].errors['wheel_rate'].overall < 1e-3
    assert shadows['free'].errors['wheel_rate'].overall > 0.1


@pytest.mark.parametrize('pace', [0.2, 1.0, 5.0])
def test_the_clock_of_the_stamps_is_followed_at_any_speed(pace: float) -> None:
    """Row 33: simulated time and its pauses; what has no stamp is placed among what has one."""
    clock = StampClock()
    assert math.isnan(clock.now(0.0))
    for step in range(200):
        arrival = 100.0 + 0.02 * step + (0.008 if step % 3 else 0.0)
        assert clock.observe(arrival, pace * 0.02 * step)
    assert clock.now(103.99) == pytest.approx(pace * 3.99, abs=0.2 * pace * 0.02 + 1e-9)
    # Paused: nothing is put further ahead than the next message.
    assert clock.now(160.0) == pytest.approx(pace * 4.0, abs=0.05 * pace)
    assert not clock.observe(161.0, 0.0)
    assert clock.now(161.0) == 0.0
