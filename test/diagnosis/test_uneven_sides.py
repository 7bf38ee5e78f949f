# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Motors of both sides are never quite alike: that is a recalibration, and no effect."""

from __future__ import annotations

from lg_husky_sim.comparison.output import simulate_commands
from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import evidence_of
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.manoeuvres import Manoeuvre, Step
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import TimeSeries
from lg_husky_sim.threads import Threads
import numpy as np
import pytest


def recorded(ratio: float) -> Recording:
    """Return a minute of a robot of such a ratio, with the noise of a good gyro."""
    model, rng = load_model(), np.random.default_rng(4)
    plant = compile_model(model.structure).at(model.parameters.replacing(
        {'side_gain_ratio': ratio}))
    steps = [(4.0, 0.0, 0.0), (12.0, 0.7, 0.0), (8.0, 0.0, 0.7), (12.0, -0.5, 0.0),
             (12.0, 0.4, -0.5), (4.0, 0.0, 0.0)]
    commands = Manoeuvre('sides', tuple(Step(*one, 0.4) for one in steps)).commands()
    streams = simulate_commands(plant, commands, 1.0)
    noise = {'wheels': 0.01, 'imu': 0.003, 'pose': 0.003}
    return Recording('sides', 'sides', {'command': streams['command'], **{
        name: TimeSeries(streams[name].times, streams[name].values + level * rng.standard_normal(
            streams[name].values.shape), streams[name].names) for name, level in noise.items()}},
        0, frames=('odom', 'base_link'))


@pytest.mark.parametrize('ratio', [1.003, 0.997])
def test_a_few_tenths_of_a_percent_between_the_sides_are_recalibrated(ratio: float) -> None:
    drives, model = drives_of([recorded(ratio)]), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['sides'], start, first_guess(drives), pool)
        fit = evidence.fit(start)
    assert fit.point.values['side_gain_ratio'] == pytest.approx(ratio, abs=0.0008)
