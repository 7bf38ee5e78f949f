# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects that begin late, from one simulation of what acts always."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import evidence_of
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.observation import observe
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.hypotheses.hypothesis import hypotheses
from lg_husky_sim.diagnosis.selection import onsets
from lg_husky_sim.husky.effects import Onset, OnsetKind
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.threads import Threads
import numpy as np
import pytest


@pytest.mark.parametrize(('name', 'numbers'), [
    ('yaw_pull', {'pull_moment': 1.0}), ('slope', {'slope_x': 10.0, 'slope_y': 4.0}),
    ('gyro_scale', {'gyro_factor': 0.95})])
def test_whitening_a_switched_change_is_whitening_a_gated_simulation(
        name: str, numbers: dict[str, float], drive: Callable[..., Recording]) -> None:
    drives, model = drives_of([drive('ahead', 'nothing', 1)]), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    onset = Onset(OnsetKind.TIME, drives[0].start + 8.0, 'ahead')
    hypothesis = next(h for h in hypotheses(model.structure) if h.effect.id == name)
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['ahead'], start, first_guess(drives), pool)
        whitener, own = evidence.whiteners[0], drives[0]
        base, plain = evidence.motions(start, True)[0], evidence.predict(start)[0]
        gated = evidence.predict(hypothesis.at(onset).point(start, numbers))[0]
        always = hypothesis.point(start, numbers)
        motion = evidence.motions(always, True)[0]
    change = observe(motion, own, always.log) - plain
    times = whitener.frame.times[whitener.frame.order]
    on = (times >= onset.value).astype(np.uint8)[:, None]
    states = onsets._built_up(own, motion, base, change, whitener.frame)
    found = whitener.switched(change, states, on)[:, 0]
    truth = whitener.apply(gated - plain)
    assert np.linalg.norm(truth) > 3.0
    assert not np.any(found[times < onset.value])
    assert np.linalg.norm(found - truth) < 0.1 * np.linalg.norm(truth)
    assert float(found @ truth) > 0.99 * np.linalg.norm(found) * np.linalg.norm(truth)
