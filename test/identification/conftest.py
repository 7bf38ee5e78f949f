# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Synthetic drives with known parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.model_file import load_model, ModelFile
from lg_husky_sim.manoeuvres import find_manoeuvre
from lg_husky_sim.recording import Segment
from lg_husky_sim.signals import TimeSeries
from lg_husky_sim.simulation import rollout
import numpy as np
import pytest

TRUTH = {'wheel_damping': 3.0, 'yaw_damping': 20.0, 'command_gain': 0.85}
QUIET = {'wheel': 0.05, 'gyro': 0.01, 'position': 0.008, 'heading': 0.004}


def drive(name: str = 'circle', truth: Mapping[str, float] = TRUTH, seed: int = 1,
          noise: Mapping[str, float] = QUIET, structure: Structure | None = None,
          recording: str = 'drive') -> Segment:
    """Return a noisy drive of a manoeuvre."""
    model = load_model()
    parameters = model.parameters
    if structure is not None:
        parameters = parameters.with_entries(*(
            p.parameter() for e in structure.effects for p in e.parameters()))
    plant = compile_model(structure or model.structure).at(parameters.replacing(truth))
    commands = find_manoeuvre(name).commands()
    seen = plant.observe(rollout(plant, commands, float(commands.times[-1]), 0.02))
    draws = np.random.default_rng(seed)

    def noisy(columns: tuple[str, ...], kind: str) -> np.ndarray:
        values = np.column_stack([seen.column(c) for c in columns])
        return values + draws.normal(0.0, noise[kind], values.shape)
    pose = np.column_stack([noisy(('x', 'y'), 'position'), noisy(('heading',), 'heading')])
    imu = np.column_stack([noisy(('yaw_rate',), 'gyro'), seen.column('accel_x'),
                           0.0 * seen.times])
    return Segment(recording, 0, float(seen.times[0]), float(seen.times[-1]), {
        'command': commands,
        'wheels': TimeSeries(seen.times, noisy(('wheel_left', 'wheel_right'), 'wheel'),
                             ('left', 'right')),
        'imu': TimeSeries(seen.times, imu, ('yaw_rate', 'accel_x', 'accel_y')),
        'pose': TimeSeries(seen.times, pose, ('x', 'y', 'heading')),
    })


@pytest.fixture(scope='session')
def circle() -> Segment:
    return drive()


@pytest.fixture(scope='session')
def husky() -> ModelFile:
    return load_model()


@pytest.fixture(scope='session')
def make_drive() -> Callable[..., Segment]:
    return drive


@pytest.fixture(scope='session')
def truth() -> dict[str, float]:
    return dict(TRUTH)
