# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Small drives with one hidden effect each, and what the diagnosis says of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache

from lg_husky_sim.comparison.output import simulate_commands
from lg_husky_sim.diagnosis.diagnose import Case, diagnose
from lg_husky_sim.diagnosis.hypotheses.hypothesis import entries_of
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.manoeuvres import Manoeuvre, Step
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import TimeSeries
import numpy as np
import pytest

STEPS = ((1.0, 0.0, 0.0), (2.0, 0.4, 0.0), (2.0, 0.8, 0.0), (2.0, 0.5, 0.6), (2.0, 0.0, 0.6),
         (2.0, -0.5, 0.0), (2.0, -0.6, -0.5), (2.0, 0.0, -0.9), (2.0, 0.7, -0.4),
         (2.0, 0.0, 0.0))
NOISE = {'wheels': 0.02, 'imu': 0.005, 'pose': 0.003, 'wheel_angles': 0.0}
#: Part of each step's duration that is long enough to name what is hidden, with its size.
SHORT = 0.5
#: What a robot differs in from the nominal model without that anything is missing.
ROBOT = {'wheel_damping': 1.3, 'yaw_damping': 14.0}
#: One hidden effect for each part of the robot.
HIDDEN: Mapping[str, tuple[Effect | None, dict[str, float]]] = {
    'nothing': (None, {}),
    'command': (Effect('command_latency'), {'latency': 0.12}),
    'electrical': (Effect('battery_sag'), {'bus_resistance': 0.2}),
    'drivetrain': (Effect('coulomb_drivetrain', 'left'), {'dry_torque': 3.0}),
    'translation': (Effect('slope'), {'slope_x': 20.0, 'slope_y': 5.0}),
    'rotation': (Effect('yaw_scrub_coulomb'), {'yaw_coulomb_moment': 4.0}),
    'sensor': (Effect('gyro_scale'), {'gyro_factor': 0.9}),
}


def driven(name: str, hidden: str, seed: int, backwards: bool = False, share: float = 1.0
           ) -> Recording:
    """Return a share of 19 s of a robot with a hidden effect, sensors noisy."""
    model = load_model()
    effect, sizes = HIDDEN[hidden]
    structure, parameters = model.structure, model.parameters.replacing(ROBOT)
    if effect is not None:
        structure = structure.with_effect(effect)
        parameters = parameters.with_entries(*entries_of(effect, sizes))
    steps = [(share * duration, forward, yaw)
             for duration, forward, yaw in (STEPS[::-1] if backwards else STEPS)]
    return recorded(name, compile_model(structure).at(parameters), steps, seed)


def recorded(name: str, plant: Plant, steps: Sequence[tuple[float, float, float]], seed: int
             ) -> Recording:
    """Return what noisy sensors see of steps of (duration, forward, yaw)."""
    script = Manoeuvre(name, tuple(Step(duration, forward, yaw, 0.2)
                                   for duration, forward, yaw in steps))
    streams = simulate_commands(plant, script.commands(), 1.0)
    rng = np.random.default_rng(seed)
    made = {'command': streams['command']}
    for stream, deviation in NOISE.items():
        series = streams[stream]
        made[stream] = TimeSeries(
            series.times, series.values + deviation * rng.standard_normal(series.values.shape),
            series.names)
    return Recording(name, name, made, 0, frames=('odom', 'base_link'))


@pytest.fixture(scope='session')
def record() -> Callable[..., Recording]:
    """Return the function that records a plant."""
    return recorded


@pytest.fixture(scope='session')
def steps() -> Sequence[tuple[float, float, float]]:
    """Return the steps of the drives: duration [s], forward speed [m/s] and yaw rate [rad/s]."""
    return STEPS


@pytest.fixture(scope='session')
def drive() -> Callable[..., Recording]:
    """Return the function that makes a drive."""
    return driven


@pytest.fixture(scope='session')
def short() -> float:
    """Return the part of each step's duration in the drives that :func:`diagnosed` has."""
    return SHORT


@pytest.fixture(scope='session')
def hidden() -> Mapping[str, tuple[Effect | None, dict[str, float]]]:
    """Return what is hidden in the drives, by part."""
    return HIDDEN


@pytest.fixture(scope='session')
def diagnosed() -> Callable[[str], Case]:
    """Return a function that diagnoses two drives with a hidden effect, once each."""
    @cache
    def made(name: str) -> Case:
        recordings = [driven('ahead', name, 1, share=SHORT),
                      driven('back', name, 2, backwards=True, share=SHORT)]
        return diagnose(recordings, load_model(), lambda text, share: None)
    return made
