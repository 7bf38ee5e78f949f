# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Where the numbers of an adopted effect begin anew."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading, WheelReading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns, loosened, window_unknown
from lg_husky_sim.diagnosis.hypotheses.hypothesis import hypotheses
from lg_husky_sim.diagnosis.selection.search import as_usual
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
import numpy as np
import pytest


def test_a_log_is_made_as_usual_again_and_the_robot_stays(drive: Callable[..., Recording]) -> None:
    """Delays and windows that strayed, and the room that a jitter gave them, are forgotten."""
    own, model = drives_of([drive('ahead', 'nothing', 1)])[0], load_model()
    usual = beginning(model.structure, base_unknowns(model.parameters, [own]),
                      model.parameters, Reading())
    hypothesis = next(h for h in hypotheses(usual.structure) if h.effect.id == 'payload')
    numbers = {p.name: hypothesis.starts[0][p.name] for p in hypothesis.free}
    mass = next(k for k, u in enumerate(usual.unknowns) if u.name == 'mass')
    moved = np.array(usual.places)
    moved[mass] += 0.1
    strayed = replace(
        usual, reading=Reading(wheels=WheelReading.FILTERED, imu=0.5).replacing(
            {'wheel_window': 0.08}),
        unknowns=(*loosened(usual.unknowns, {'command_delay': 0.05, 'delay_wheels': 0.05}),
                  window_unknown('imu_window', 0.02, 0.05)),
        places=np.append(moved + np.array([0.03 * (u.kind == 'log') for u in usual.unknowns]),
                         np.log(0.02)))
    found = as_usual(hypothesis.point(strayed, numbers))
    expected = hypothesis.point(usual.at(moved), numbers)
    assert found.reading == Reading()
    assert [u.name for u in found.unknowns] == [u.name for u in expected.unknowns]
    assert [u.deviation for u in found.unknowns] == pytest.approx(
        [u.deviation for u in expected.unknowns])
    assert found.places == pytest.approx(expected.places)
