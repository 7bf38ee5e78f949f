# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What recordings of one robot have in common, by what each of them says."""

from __future__ import annotations

from dataclasses import replace

from lg_husky_sim.diagnosis.before_after.base import base_of
from lg_husky_sim.diagnosis.before_after.evidence import Quadratic
from lg_husky_sim.diagnosis.before_after.fitting import Prior
from lg_husky_sim.diagnosis.before_after.middle import middle
from lg_husky_sim.diagnosis.before_after.settings import settings
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.signals import FloatArray
import numpy as np
import pytest

BASE = base_of(settings(), load_model().parameters)
GYRO = BASE.names.index('gyro_factor')
PRIOR = Prior(BASE.start, BASE.sd, np.arange(BASE.sd.size) == GYRO)
APART = np.full(BASE.sd.size, 3e-4)


def told(name: str, factor: float, sd: float) -> tuple[FloatArray, Quadratic]:
    """Return where a recording is likeliest, and the likelihood there, of the gyro's factor."""
    place, curvature = np.array(BASE.start), np.zeros((BASE.sd.size,) * 2)
    place[GYRO], curvature[GYRO, GYRO] = factor, sd ** -2
    return place, Quadratic(name, False, place, curvature, curvature @ place)


def mean(*each: tuple[FloatArray, Quadratic]) -> float:
    """Return the mean of the gyro's factor."""
    return float(middle(BASE, PRIOR, APART, {one.recording: place for place, one in each},
                        [one for _, one in each])[GYRO])


def test_recordings_that_tell_as_much_count_alike() -> None:
    assert mean(told('a', 0.98, 1e-4), told('b', 0.99, 1e-4)) == pytest.approx(0.985, abs=1e-5)


def test_a_straight_drive_does_not_move_the_mean_of_the_turns() -> None:
    """Its gyro's factor may have ended anywhere; the others' deviate by 0.0003."""
    turning = [told(name, 0.9995, 1e-4) for name in 'abc']
    assert mean(*turning, told('straight', 0.74, 0.05)) == pytest.approx(0.9995, abs=1e-4)


def test_what_no_recording_tells_stays_as_expected() -> None:
    place, one = told('a', 0.74, 1.0)
    assert mean((place, replace(one, curvature=0.0 * one.curvature))) == BASE.start[GYRO]
