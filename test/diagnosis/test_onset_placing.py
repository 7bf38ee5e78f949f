# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Where an onset is placed does not depend on where the fit of it began."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import evidence_of
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.hypotheses.hypothesis import hypotheses
from lg_husky_sim.diagnosis.selection.onsets import refined
from lg_husky_sim.diagnosis.selection.rounds import attempt, calibrated
from lg_husky_sim.diagnosis.selection.tried import numbers_of
from lg_husky_sim.husky.effects import Effect, Onset, OnsetKind
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.recording import Recording
from lg_husky_sim.threads import Threads
import numpy as np
import pytest


def dragged(robot: Callable[..., Plant], record: Callable[..., Recording], seed: int,
            begin: float) -> Recording:
    """Return a drive of half a minute, fast and slow, with a drag from some time on."""
    random = np.random.default_rng(seed)
    plant = robot(Effect('quadratic_drag', late=True), drag=25.0,
                  onset=Onset(OnsetKind.TIME, begin, 'rec'))
    steps = [(float(random.uniform(0.8, 3.0)), float(random.choice([0.1, 0.9, -0.9, 0.5])),
              float(random.uniform(-0.4, 0.4))) for _ in range(16)]
    return record('rec', plant, [(1.0, 0.0, 0.0), *steps, (1.0, 0.0, 0.0)], seed)


@pytest.mark.parametrize(('seed', 'begin'), [(0, 22.0), (4, 23.6)])
def test_from_any_time_of_the_coarse_grid_the_true_onset_is_found(
        robot: Callable[..., Plant], record: Callable[..., Recording], seed: int, begin: float
        ) -> None:
    """It shows in moments only: by steps from there the fit ends up to 18 s beside it."""
    drives, model = drives_of([dragged(robot, record, seed, begin)]), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    drag, = (one for one in hypotheses(model.structure) if one.effect.id == 'quadratic_drag')
    with Threads(1) as pool:
        evidence, base = calibrated(
            evidence_of(drives, ['rec'], start, first_guess(drives), pool), start, 1)
        for far in (3.0, 11.0, 27.0):
            tried = attempt(evidence, base, drag.at(Onset(OnsetKind.TIME, far, 'rec')), [
                (base.point, drag.starts[0])])
            assert tried is not None
            found = refined(evidence, base, tried, attempt, numbers_of)
            assert found.hypothesis.onset.value == pytest.approx(begin, abs=0.25)
            assert found.gain >= tried.gain
