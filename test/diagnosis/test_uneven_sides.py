# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Motors of both sides are never quite alike: that is a recalibration, and no effect."""

from __future__ import annotations

from collections.abc import Mapping

from lg_husky_sim.comparison.output import simulate_commands
from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import evidence_of
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.selection.rounds import calibrated
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.manoeuvres import Manoeuvre, Step
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import TimeSeries
from lg_husky_sim.threads import Threads
import numpy as np
import pytest

#: Standard deviations of a good gyro and other good sensors.
NOISE = {'wheels': 0.01, 'imu': 0.003, 'pose': 0.003}


def recorded(noise: Mapping[str, float] = NOISE, **values: float) -> Recording:
    """Return a minute of a robot with other parameters."""
    model, rng = load_model(), np.random.default_rng(4)
    plant = compile_model(model.structure).at(model.parameters.replacing(values))
    steps = [(4.0, 0.0, 0.0), (12.0, 0.7, 0.0), (8.0, 0.0, 0.7), (12.0, -0.5, 0.0),
             (12.0, 0.4, -0.5), (4.0, 0.0, 0.0)]
    commands = Manoeuvre('sides', tuple(Step(*one, 0.4) for one in steps)).commands()
    streams = simulate_commands(plant, commands, 1.0)
    return Recording('sides', 'sides', {'command': streams['command'], **{
        name: TimeSeries(streams[name].times, streams[name].values + level * rng.standard_normal(
            streams[name].values.shape), streams[name].names) for name, level in noise.items()}},
        0, frames=('odom', 'base_link'))


@pytest.mark.parametrize('ratio', [1.003, 0.997])
def test_a_few_tenths_of_a_percent_between_the_sides_are_recalibrated(ratio: float) -> None:
    drives, model = drives_of([recorded(side_gain_ratio=ratio)]), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['sides'], start, first_guess(drives), pool)
        fit = evidence.fit(start)
    assert fit.point.values['side_gain_ratio'] == pytest.approx(ratio, abs=0.0008)


def test_motors_that_answer_later_are_recalibrated_and_the_robot_is_no_heavier() -> None:
    """Their inductance; without it the resistance fell to a half, and all masses doubled."""
    model = load_model()
    late = 2.5 * model.parameters['motor_inductance']
    drives = drives_of([recorded({**NOISE, 'wheels': 0.0005}, motor_inductance=late)])
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['sides'], start, first_guess(drives), pool)
        _, fit = calibrated(evidence, start)
    assert fit.point.values['motor_inductance'] == pytest.approx(late, rel=0.3)
    assert fit.point.values['mass'] == pytest.approx(model.parameters['mass'], rel=0.1)
