# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Fits of one likelihood: they find the numbers, and their intervals cover."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from lg_husky_sim.diagnosis.conclusion import estimates
from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import beginning, Evidence, evidence_of
from lg_husky_sim.diagnosis.evidence.noise import first_guess, sensor_variance
from lg_husky_sim.diagnosis.evidence.observation import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.selection.rounds import calibrated
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
import numpy as np
import pytest

ROBOT = {'wheel_damping': 1.3, 'yaw_damping': 14.0}
COUNT = 12


def test_a_fit_finds_the_numbers_and_its_intervals_cover(drive: Callable[..., Recording]
                                                         ) -> None:
    drives, model = drives_of([drive('ahead', 'nothing', 1)]), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with ThreadPoolExecutor(1) as pool:
        evidence, fit = calibrated(
            evidence_of(drives, ['ahead'], start, first_guess(drives), pool), start, 1)
        found = {e.name: e for e in estimates(fit, list(ROBOT), model.parameters)}
        for name, value in ROBOT.items():
            assert found[name].value == pytest.approx(value, rel=0.1), name
            assert found[name].low < found[name].value < found[name].high
        # Drives of a robot whose numbers are known: those of the fit.
        truth = fit.point.values
        level = np.sqrt(sensor_variance(evidence.whiteners[0].frame, evidence.noise))
        rng = np.random.default_rng(7)
        hits = []
        for _ in range(COUNT):
            made = replace(drives[0], measured=fit.predicted[0]
                           + level * rng.standard_normal(level.size))
            again = Evidence([made], evidence.names, evidence.noise, evidence.whiteners,
                             pool).fit(fit.point, fit.slopes, rounds=3)
            hits += [e.low <= truth[e.name] <= e.high
                     for e in estimates(again, list(ROBOT), model.parameters)]
    assert np.mean(hits) >= 0.85
