# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""An effect of a place acts when the robot was there, wherever the simulation is by then."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from lg_husky_sim.diagnosis.evidence.drives import Channel, Drive, drives_of
from lg_husky_sim.diagnosis.evidence.measured_place import acts_at, is_measured, legs_of
from lg_husky_sim.diagnosis.evidence.observation import simulate
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.hypotheses.hypothesis import entries_of
from lg_husky_sim.husky.effects import Effect, Onset, OnsetKind
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.recording import Recording
import numpy as np
import pytest


@pytest.fixture(scope='module')
def driven(drive: Callable[..., Recording]) -> Drive:
    """Return one drive of a robot that lacks nothing."""
    return drives_of([drive('ahead', 'nothing', 1)])[0]


def halfway(drive: Drive) -> Onset:
    """Return a place that the robot crosses more than once."""
    x = drive.measured[drive.slice_of(Channel.X)]
    return Onset(OnsetKind.PLACE_ABOVE, float(x[0] + 0.6 * (np.max(x) - x[0])))


def heavy(onset: Onset | None, gain: float) -> Plant:
    """Return a robot with much to carry from an onset on, whose commands are amplified."""
    model, effect = load_model(), Effect('payload', late=onset is not None)
    parameters = model.parameters.replacing({
        'command_gain': gain * model.parameters['command_gain']})
    return compile_model(model.structure.with_effect(effect, onset)).at(
        parameters.with_entries(*entries_of(effect, {'payload_mass': 60.0})))


@pytest.mark.parametrize('delay', [0.0, 0.08])
def test_legs_turn_where_the_measured_pose_crosses(driven: Drive, delay: float) -> None:
    onset = halfway(driven)
    legs = legs_of(driven, onset, delay)
    assert len(legs) >= 3
    assert legs[-1][0] == np.inf
    assert [second for _, second in legs] == [bool(k % 2) for k in range(len(legs))]
    for end, second in legs[:-1]:
        around = acts_at(driven, onset, np.array([end - 1e-6, end + 1e-6]), delay)
        assert around.tolist() == [second, not second]
    early = legs_of(driven, onset, 0.0)
    assert legs[0][0] == pytest.approx(early[0][0] - delay, abs=1e-9)


def test_a_place_that_is_never_crossed_is_one_leg(driven: Drive) -> None:
    for kind, second in ((OnsetKind.PLACE_ABOVE, False), (OnsetKind.PLACE_BELOW, True)):
        assert legs_of(driven, Onset(kind, 1e3), 0.0) == [(np.inf, second)]


def test_a_simulation_that_is_elsewhere_meets_it_when_the_robot_did(driven: Drive) -> None:
    """A robot that drives a fifth too far had it seconds too early."""
    onset, reading = halfway(driven), Reading()
    motion = simulate(heavy(onset, 1.2), driven, reading)
    x = driven.measured[driven.slice_of(Channel.X)]
    on = onset.value
    late = motion.late()
    measured = np.interp(motion.times, driven.pose_times, x) >= on
    np.testing.assert_array_equal(late, measured)
    simulated = motion.rows[:, 11] >= on
    assert np.mean(simulated != measured) > 0.02
    # Until the robot is there it is the plain one, and from then on it is not.
    plain = simulate(heavy(Onset(OnsetKind.PLACE_ABOVE, 1e3), 1.2), driven, reading)
    order = np.argsort(motion.times, kind='stable')
    first = np.flatnonzero(measured[order])[0]
    difference = np.max(np.abs(motion.rows - plain.rows), axis=1)[order]
    assert np.max(difference[:first]) < 1e-6
    assert np.max(difference[first:]) > 0.01


def test_without_a_pose_the_simulation_says_where_it_is(driven: Drive) -> None:
    blind = replace(driven, pose_times=driven.pose_times[:0])
    assert is_measured(driven, halfway(driven))
    assert not is_measured(blind, halfway(driven))
    assert not is_measured(driven, Onset(OnsetKind.TIME, 1.0))
    assert not is_measured(driven, None)


def test_an_onset_of_which_no_effect_is_left_changes_nothing(driven: Drive) -> None:
    model, reading = load_model(), Reading()
    left = replace(model.structure, onset=halfway(driven))
    plain, kept = (simulate(compile_model(structure).at(model.parameters), driven, reading)
                   for structure in (model.structure, left))
    np.testing.assert_array_equal(kept.rows, plain.rows)
