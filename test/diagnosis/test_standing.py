# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Encoders that are dead while the pose of the robot moves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from lg_husky_sim.diagnosis.diagnose import diagnose
from lg_husky_sim.diagnosis.result import Verdict
from lg_husky_sim.diagnosis.sensors.faults import Fault, faults
from lg_husky_sim.diagnosis.sensors.relations import relations
from lg_husky_sim.diagnosis.sensors.standing import standing
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording, segments
import numpy as np
import pytest


@pytest.fixture(scope='module')
def clean(drive: Callable[..., Recording]) -> Recording:
    """Return a drive of a robot that lacks nothing."""
    return drive('clean', 'nothing', 3)


def turning(recording: Recording, factors: tuple[float, float]) -> Recording:
    """Return a recording with so much of the rates of the left and right wheels."""
    wheels = recording.stream('wheels')
    streams = {**recording.streams, 'wheels': replace(
        wheels, values=wheels.values * np.array(factors))}
    streams.pop('wheel_angles', None)
    return replace(recording, streams=streams)


def found(recording: Recording) -> tuple[Fault, ...]:
    parts = segments(recording)
    return faults(relations(parts), parts)


@pytest.mark.parametrize(('factors', 'words'), [
    ((0.0, 0.0), 'The wheels stand still while the pose moves for'),
    ((0.0, 1.0), 'The left wheels stand still'), ((1.0, 0.0), 'The right wheels stand still')])
def test_encoders_that_stand_still_are_found_by_the_pose(
        factors: tuple[float, float], words: str, clean: Recording) -> None:
    """Nothing follows what is always zero: such wheels have no relation to another stream."""
    one = found(turning(clean, factors))[0]
    assert (one.effect, one.stream) == (None, 'wheels')
    assert one.statement.startswith(words)


def test_a_diagnosis_says_of_dead_encoders_that_no_model_can_be_compared(
        clean: Recording) -> None:
    """It named a dead band of the driver, or looked for names for minutes."""
    dead = turning(clean, (0.0, 0.0))
    said = diagnose([dead], load_model(), lambda text, share: None).diagnosis
    assert said.verdict is Verdict.UNKNOWN
    assert 'The wheels stand still' in said.findings[0].statement


def test_a_robot_at_rest_has_no_dead_encoders(clean: Recording) -> None:
    still = turning(clean, (0.0, 0.0))
    pose = still.stream('pose')
    at_rest = replace(still, streams={**still.streams, 'pose': replace(
        pose, values=0.0 * pose.values)})
    assert standing(segments(at_rest)) == ((), 0.0)


def test_a_recording_without_wheels_does_not_hide_dead_ones(clean: Recording) -> None:
    dead = turning(clean, (0.0, 0.0))
    none = replace(dead, streams={k: v for k, v in dead.streams.items() if k != 'wheels'})
    assert standing((*segments(none), *segments(dead)))[0] == ('left', 'right')
