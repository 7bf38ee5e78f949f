# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""An effort that no sensor sees has no evidence, whatever rounding leaves of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from lg_husky_sim.diagnosis.decision.adoption import evidence_beyond_chance
from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, evidence_of, Fit
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.hypotheses.lines import lines
from lg_husky_sim.diagnosis.hypotheses.smooth_efforts import efforts
from lg_husky_sim.diagnosis.hypotheses.waves import waves
from lg_husky_sim.diagnosis.localisation import missing_efforts
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.threads import Threads
import numpy as np
import pytest


@pytest.fixture(scope='module')
def turning(drive: Callable[..., Recording]) -> Iterator[tuple[Evidence, Fit]]:
    """Return what a gyro alone tells of a robot whose tyres scrub, and a fit without that."""
    recording = drive('ahead', 'rotation', 1, share=0.5)
    blind = replace(recording, streams={
        name: series for name, series in recording.streams.items() if name in ('command', 'imu')})
    drives, model = drives_of([blind]), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['ahead'], start, first_guess(drives), pool)
        yield evidence, evidence.fit(start)


def test_a_gyro_alone_tells_of_moments_and_of_no_force(turning: tuple[Evidence, Fit]) -> None:
    """It told of 4e18 N: of what is left where the sides of a robot cancel."""
    found = {effort.balance: effort for effort in reversed(efforts(*turning))}
    assert found['moment'].evidence > evidence_beyond_chance(30)
    assert 'force' not in found
    missing = {one.balance: one for one in missing_efforts(*turning)}
    assert missing['moment'].evidence > evidence_beyond_chance(30)
    assert missing['force'].evidence == missing['force'].bursts == 0.0
    assert not np.any(missing['force'].values)
    with np.errstate(all='raise'):
        assert all(line.balance != 'force' for line in lines(*turning))
    assert waves(*turning) == ()
