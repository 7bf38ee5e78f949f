# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""When the filter of a drive takes commands for lost, and when for late."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from lg_husky_sim.diagnosis.evidence.drives import Drive, drives_of
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, evidence_of
from lg_husky_sim.diagnosis.evidence.frames import Frame, frame_of
from lg_husky_sim.diagnosis.evidence.noise import first_guess, whitener_of
from lg_husky_sim.diagnosis.evidence.observation import observe, simulate
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.threads import Threads
import numpy as np
import pytest

REACH = 0.15
"""How far from its time a command may come [s]: beyond the next one."""


@pytest.fixture(scope='module')
def gapped(drive: Callable[..., Recording]) -> Evidence:
    """Return the evidence of a drive whose log lacks one command of each ramp."""
    recording = drive('ahead', 'nothing', 1, share=0.5)
    sent = recording.streams['command']
    moved = np.flatnonzero(np.any(np.diff(sent.values, axis=0) != 0.0, axis=1)) + 1
    keep = np.setdiff1d(np.arange(len(sent)), moved[1::7])
    streams = {**recording.streams,
               'command': TimeSeries(sent.times[keep], sent.values[keep], sent.names)}
    drives, model = drives_of([replace(recording, streams=streams)]), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        return evidence_of(drives, ['ahead'], start, first_guess(drives), pool)


def framed(drive: Drive, plant: Plant, reading: Reading, reach: float) -> Frame:
    """Return the frame of a drive of a robot."""
    motion = simulate(plant, drive, reading, True)
    return frame_of(drive, plant, motion, observe(motion, drive, reading), reading, reach)


def spread(evidence: Evidence, frame: Frame, kicks: FloatArray) -> FloatArray:
    """Return the standard deviations that innovations have with such kicks."""
    return whitener_of(replace(frame, kicks=np.ascontiguousarray(kicks)),
                       evidence.whiteners[0].model, evidence.noise).scale


def test_a_lost_command_is_unsure_from_its_time_on_whatever_may_still_come(
        gapped: Evidence, robot: Callable[..., Plant]) -> None:
    """It waited until steps before it had come for sure."""
    frame = framed(gapped.drives[0], robot(), Reading(), REACH)
    lost = frame.kicks[:, 5] == 0.0
    assert 2 <= np.count_nonzero(lost) < lost.size
    without_steps = np.array(frame.kicks)
    without_steps[:, 3:5] = 0.0
    np.testing.assert_array_equal(spread(gapped, frame, without_steps),
                                  spread(gapped, frame, frame.kicks[lost]))
    assert np.max(spread(gapped, frame, frame.kicks[lost])
                  / spread(gapped, frame, np.zeros((0, 6)))) > 1.01


def test_a_step_may_have_come_though_a_command_before_it_is_not_lost_yet(
        gapped: Evidence, robot: Callable[..., Plant]) -> None:
    frame = framed(gapped.drives[0], robot(), Reading(), REACH)
    lost = frame.kicks[:, 5] == 0.0
    sure = np.array(frame.kicks)
    sure[:, 1:3] = 0.0
    np.testing.assert_array_equal(spread(gapped, frame, sure),
                                  spread(gapped, frame, frame.kicks[~lost]))


@pytest.mark.parametrize(('latency', 'delay'), [(0.0, 0.08), (0.08, 0.0)])
def test_a_lost_command_is_missed_when_it_would_have_acted(
        gapped: Evidence, robot: Callable[..., Plant], latency: float, delay: float) -> None:
    """Not when it would have been logged: the base has not missed anything by then."""
    drive, late = gapped.drives[0], latency + delay
    plant = robot('command_latency', latency=latency) if latency else robot()
    frame = framed(drive, plant, Reading(values={'command_delay': delay}), 0.001)
    kicks = frame.kicks[frame.kicks[:, 5] == 0.0]
    usual = float(np.median(np.diff(drive.commands.times)))
    before = drive.commands.times[np.flatnonzero(np.diff(drive.commands.times) > 1.5 * usual)]
    np.testing.assert_allclose(kicks[::2, 0], before + 0.5 * usual + late, atol=1e-9)
    # By what the wheels do then, too: as much as without a delay.
    early = framed(drive, robot(), Reading(), 0.001).kicks
    np.testing.assert_allclose(kicks[:, 1:3], early[early[:, 5] == 0.0][:, 1:3], rtol=0.1,
                               atol=1e-3)
