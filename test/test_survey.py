# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What `info` says of a recording before any fit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import lg_husky_sim as lg
from lg_husky_sim.api.surveys import limits
from lg_husky_sim.resources import config_path
from lg_husky_sim.signals import TimeSeries
import numpy as np
import pytest
import yaml


@pytest.fixture(scope='module')
def drive() -> lg.Recording:
    return lg.Husky().simulate('obstacle')


def with_streams(recording: lg.Recording, **streams: TimeSeries | None) -> lg.Recording:
    """Return a recording with streams exchanged, or left out where they are None."""
    merged = {**recording.streams, **streams}
    return replace(recording, streams={k: v for k, v in merged.items() if v is not None})


def scaled(series: TimeSeries, factor: float) -> TimeSeries:
    return TimeSeries(series.times, series.values * factor, series.names)


def test_a_whole_drive_is_enough_and_nothing_is_wrong(drive: lg.Recording) -> None:
    survey = drive.info()
    assert survey.enough
    assert survey.warnings == ()
    assert survey.verdict == 'Enough for a diagnosis.'
    assert {row[0] for row in survey.streams.rows} >= {'command', 'wheels', 'imu', 'pose'}
    assert str(survey).count('\n') > 10


def test_wheels_off_the_ground_are_seen_at_once(drive: lg.Recording) -> None:
    still = TimeSeries(drive.pose.times, np.zeros_like(drive.pose.values), drive.pose.names)
    warnings = with_streams(drive, pose=still).info().warnings
    assert len(warnings) == 1
    assert warnings[0].startswith('There is no ground reaction')
    assert 'wheels are off the ground' in warnings[0]


def test_a_robot_with_other_wheels_is_no_husky(drive: lg.Recording) -> None:
    slow = scaled(drive.wheels, 0.165 / 0.3)
    warnings = with_streams(drive, wheels=slow).info().warnings
    assert any('This is not a Husky' in one for one in warnings)
    assert not any('This is not a Husky' in one for one in
                   with_streams(drive, wheels=scaled(drive.wheels, 1.05)).info().warnings)


def test_a_robot_that_is_not_that_of_the_model_is_called_so(drive: lg.Recording) -> None:
    said = drive.info(lg.Husky(wheel_radius=0.1)).warnings
    assert any(one.startswith('This is not the robot of the model: ') for one in said)
    assert not any('Husky' in one for one in said)


def test_a_robot_of_its_own_dimensions_is_no_stranger_to_its_model(drive: lg.Recording) -> None:
    slow = with_streams(drive, wheels=scaled(drive.wheels, 0.165 / 0.3))
    assert not any('This is not a Husky' in one
                   for one in slow.info(lg.Husky(wheel_radius=0.3)).warnings)


def test_without_commands_or_measurements_the_survey_says_what_is_missing(
        drive: lg.Recording) -> None:
    said = with_streams(drive, command=None).info()
    assert not said.enough
    assert said.missing[0].startswith('velocity commands')
    only = replace(drive, streams={'command': drive.command}).info()
    assert only.missing[0].startswith('a measurement')
    assert only.verdict == 'Not enough for a diagnosis.'


@pytest.mark.parametrize(('stream', 'word'), [
    ('wheels', 'No wheels (JointState)'), ('imu', 'No IMU (Imu)'),
    ('pose', 'No pose (TF, Odometry or PoseStamped)')])
def test_a_stream_that_is_missing_is_a_reservation(
        drive: lg.Recording, stream: str, word: str) -> None:
    survey = with_streams(drive, **{stream: None}).info()
    assert survey.enough
    assert survey.verdict == 'Enough for a diagnosis, with reservations.'
    assert [one for one in survey.warnings if one.startswith('No ')] == [
        one for one in survey.warnings if one.startswith(word)]
    assert any(one.startswith(word) for one in survey.warnings)


def test_a_drive_that_hardly_moves_is_not_enough() -> None:
    times = np.arange(0.0, 6.0, 0.05)
    short = lg.Husky().simulate((times, 0.4 + 0.0 * times, 0.0 * times)).info()
    assert short.missing[0].startswith('motion: 6.0 s' if short.missing else 'none')


def test_the_share_of_each_regime_adds_up_to_the_motion() -> None:
    times = np.arange(0.0, 40.0, 0.05)
    forward = np.where(times < 10, 0.5, np.where(times < 20, 0.0, np.where(times < 30, -0.4, 0.0)))
    yaw = np.where((times >= 10) & (times < 20), 0.6, 0.0)
    rows = {name: time for name, time, _ in lg.Husky().simulate(
        (times, forward, yaw)).info().excitation.rows}
    assert rows['straight ahead'] == pytest.approx(10.0, abs=0.1)
    assert rows['turning on the spot'] == pytest.approx(10.0, abs=0.1)
    assert rows['reversing'] == pytest.approx(10.0, abs=0.1)
    assert rows['at rest'] == pytest.approx(10.0, abs=0.1)
    assert rows['turning while driving'] == 0.0


def test_what_a_straight_drive_cannot_determine_is_said_before_any_fit() -> None:
    times = np.arange(0.0, 30.0, 0.05)
    straight = lg.Husky().simulate((times, 0.3 + 0.2 * np.sin(times), 0.0 * times)).info()
    bend = lg.Husky().simulate((times, 0.3 + 0.2 * np.sin(times), 0.5 * np.sin(times))).info()

    def verdict(survey: lg.Survey) -> str:
        return next(str(row[4]) for row in survey.parameters.rows if row[0] == 'yaw_damping')
    assert verdict(straight) == 'hardly determined'
    assert verdict(bend) == 'determined'


def test_a_sensor_that_falls_silent_before_the_commands_is_named(drive: lg.Recording) -> None:
    part = with_streams(drive, wheels=drive.wheels.slice(0.0, 8.0))
    assert any(one.startswith('Stream wheels ends') for one in part.info().warnings)


@pytest.mark.parametrize(('served', 'bunches'), [(0.0, False), (0.34, True)])
def test_commands_that_were_stamped_in_bunches_are_named(
        drive: lg.Recording, served: float, bunches: bool) -> None:
    """A recorder looked for them three times a second: each look stamped all that had come."""
    times = np.arange(drive.command.times[0], drive.command.times[-1], 0.05)
    held = np.searchsorted(drive.command.times, times, side='right') - 1
    if served:
        times = served * np.ceil(times / served) + 1e-5 * np.arange(times.size)
    else:
        times = times + np.random.default_rng(1).uniform(-0.02, 0.02, times.size)
    commands = TimeSeries(times, drive.command.values[held], drive.command.names)
    said = [one for one in with_streams(drive, command=commands).info().warnings
            if one.startswith('Stream command comes in bunches: ')]
    assert len(said) == bunches


def test_a_drive_faster_than_any_husky_is_named() -> None:
    times = np.arange(0.0, 15.0, 0.05)
    fast = lg.Husky().simulate((times, 3.0 + 0.0 * times, 0.0 * times))
    assert any('whole supply at 1.12 m/s' in one for one in fast.info().warnings)
    faster = lg.Husky(command_gain=0.4)
    assert not any('whole supply' in one for one in fast.info(faster).warnings)


def test_each_limit_has_unit_meaning_and_source() -> None:
    entries = yaml.safe_load(Path(config_path('survey.yaml')).read_text('utf-8'))['limits']
    assert set(entries) == set(limits())
    for entry in entries.values():
        assert set(entry) == {'value', 'unit', 'meaning', 'source'}


def test_the_survey_as_data_holds_what_the_text_says(drive: lg.Recording) -> None:
    data = drive.info().data()
    assert data['enough_for_diagnose'] is True
    assert data['schema'] == 'lg_husky_sim/survey/1'
    streams = data['streams']
    assert isinstance(streams, list)
    assert streams[0]['stream'] == 'command'


def test_shares_of_regimes_that_overlap_are_called_so(drive: lg.Recording) -> None:
    assert 'in other regimes too' in drive.info().excitation.title


def test_a_perfect_model_leaves_no_error_that_has_a_cause(drive: lg.Recording) -> None:
    said = str(lg.compare(drive, progress=False).what_to_change)
    assert 'If errors remain, they have another cause' in said


def test_wheels_off_the_ground_are_no_reservation(drive: lg.Recording) -> None:
    """A diagnosis would not look for effects there."""
    pose = drive.pose
    noise = 0.003 * np.random.default_rng(1).standard_normal(pose.values.shape)
    lifted = with_streams(drive, pose=replace(pose, values=noise), imu=None).info()
    assert lifted.differs
    assert lifted.verdict.startswith('No diagnosis is possible with this model')
    assert any('no ground reaction' in one for one in lifted.warnings)
    assert not drive.info().differs
