# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A model that runs away is refused; it is not driven by ever shorter steps."""

from __future__ import annotations

from lg_husky_sim.diagnosis.hypotheses.hypothesis import entries_of
from lg_husky_sim.errors import ParameterError
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import TimeSeries
from lg_husky_sim.simulation.events import trajectory
from lg_husky_sim.simulation.simulator import Simulator
import numpy as np
import pytest

COMMANDS = TimeSeries(np.array([0.0]), np.array([[1.0, 0.5]]), ('forward', 'yaw'))


def _plant(slope: float) -> Plant:
    # A scrub that falls with the forward speed turns the base ever faster.
    model, scrub = load_model(), Effect('yaw_scrub_speed')
    parameters = model.parameters.replacing({'yaw_damping': 0.5})
    return compile_model(model.structure.with_effect(scrub)).at(
        parameters.with_entries(*entries_of(scrub, {'scrub_slope': slope})))


def test_a_model_that_runs_away_is_refused_at_once() -> None:
    with pytest.raises(ParameterError, match=r'is unstable: it exceeds 1000 m/s'):
        trajectory(_plant(-60.0), COMMANDS, np.linspace(0.0, 20.0, 200), start=0.0)


def test_the_stepping_simulator_refuses_it_too() -> None:
    simulator = Simulator(_plant(-60.0), 0.02)
    with pytest.raises(ParameterError, match='is unstable'):
        simulator.run(simulator.initial(), np.tile([1.0, 0.5], (1000, 1)))


def test_a_model_that_does_not_run_away_is_driven_to_its_end() -> None:
    moved = trajectory(_plant(4.0), COMMANDS, np.linspace(0.0, 20.0, 200), start=0.0)
    assert np.all(np.isfinite(moved.values))
    assert 0.0 < moved.column('yaw_rate')[-1] < 10.0
