# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What a base had been told until a simulation of it begins."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.husky.effects import Effect, Onset, OnsetKind
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import BodyTwist, TimeSeries
from lg_husky_sim.simulation import Simulator
from lg_husky_sim.simulation.initial_state import InitialStates
from lg_husky_sim.simulation.starting import at_rest, commanded_until
import numpy as np
import pytest

Maker = Callable[..., Plant]
TOLD = TimeSeries(np.array([1.0, 2.0, 3.0]), np.array([[0.2, 0.1], [0.5, -0.4], [0.8, 0.0]]),
                  ('forward', 'yaw'))
ROLLING = BodyTwist(0.5, 0.0)


@pytest.mark.parametrize(('start', 'wanted'), [
    (2.5, (0.5, -0.4)), (3.0, (0.8, 0.0)), (9.0, (0.8, 0.0)),
    (0.995, (0.2, 0.1)), (0.6, (0.2, 0.1)),  # it has had one like it: bases forget older ones
    (0.4, (0.0, 0.0))])
def test_a_base_that_moves_follows_the_command_in_force(
        start: float, wanted: tuple[float, float]) -> None:
    assert commanded_until(start, TOLD, ROLLING) == BodyTwist(*wanted)


@pytest.mark.parametrize(('twist', 'rates', 'rest'), [
    (BodyTwist(), None, True),
    (BodyTwist(-0.03, 0.02), None, True),  # noise of a pose's slope
    (BodyTwist(0.1, 0.0), None, False),
    (BodyTwist(0.0, -0.1), None, False),
    (BodyTwist(0.1, 0.1), (0.05, -0.1), True),  # wheels tell better than a pose
    (BodyTwist(), (0.05, -0.5), False),
])
def test_noise_is_no_motion(twist: BodyTwist, rates: tuple[float, float] | None, rest: bool
                            ) -> None:
    assert at_rest(twist, rates) == rest
    told = commanded_until(2.5, TOLD, twist, rates)
    assert told == (BodyTwist() if rest else BodyTwist(0.5, -0.4))


def test_a_command_is_forgotten_after_the_timeout() -> None:
    assert commanded_until(3.4, TOLD, ROLLING, timeout=0.5) == BodyTwist(0.8, 0.0)
    assert commanded_until(3.6, TOLD, ROLLING, timeout=0.5) == BodyTwist()
    assert commanded_until(3600.0, TOLD, ROLLING, timeout=0.0) == BodyTwist(0.8, 0.0)


def test_of_nothing_nothing_was_commanded() -> None:
    nothing = TimeSeries(np.zeros(0), np.zeros((0, 2)), ('forward', 'yaw'))
    assert commanded_until(1.0, nothing, ROLLING) == BodyTwist()


@pytest.mark.parametrize(('kind', 'value', 'time', 'limited'), [
    (OnsetKind.TIME, 5.0, 4.0, False), (OnsetKind.TIME, 5.0, 6.0, True),
    (OnsetKind.PLACE_BELOW, -1.0, 6.0, False), (OnsetKind.PLACE_BELOW, 1.0, 6.0, True)])
def test_a_start_is_limited_as_the_base_is_then(
        robot: Maker, kind: OnsetKind, value: float, time: float, limited: bool) -> None:
    """A ramp down from more than the limit would take seconds."""
    plant = robot('command_slew', Effect('command_limit', shape='forward', late=True),
                  onset=Onset(kind, value), slew_forward=0.2, limit_forward=0.4)
    simulator = Simulator(plant, 0.01)
    state = simulator.step(simulator.initial(
        twist=BodyTwist(0.4, 0.0), time=time, command=BodyTwist(0.9, 0.0)), BodyTwist(0.9, 0.0))
    reached = 0.5 * sum(state.voltages) / plant.sets[0].command.volts_per_speed
    assert reached == pytest.approx(0.4 if limited else 0.9, abs=1e-9)


@pytest.mark.parametrize('twist', [BodyTwist(0.7, 0.0), BodyTwist(-0.2, 0.4), ROLLING])
def test_rates_and_velocity_without_slip_belong_together(twist: BodyTwist) -> None:
    model = load_model()
    starts = InitialStates(compile_model(model.structure).at(model.parameters))
    left, right = starts.rates_without_slip(twist)
    found = starts.twist_without_slip(left, right)
    assert found.forward == pytest.approx(twist.forward, abs=1e-12)
    assert found.yaw == pytest.approx(twist.yaw, abs=1e-12)
    state = starts.flat(twist=twist)
    seen = compile_model(model.structure).at(model.parameters).sets[0].rows[:4] @ state[:6]
    np.testing.assert_allclose(seen, [left, right, twist.forward, twist.yaw], atol=1e-9)


def test_a_base_whose_wheels_slip_begins_with_all_that_was_measured() -> None:
    model = load_model()
    plant = compile_model(model.structure).at(model.parameters)
    state = InitialStates(plant).flat(twist=BodyTwist(0.6, -0.3), wheel_rates=(4.5, 2.0))
    seen = plant.sets[0].rows[:4] @ state[:len(plant.states)]
    np.testing.assert_allclose(seen, [4.5, 2.0, 0.6, -0.3], atol=1e-9)
