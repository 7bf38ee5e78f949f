# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A model replays its own drive; the state at the start is found again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import lg_husky_sim as lg
from lg_husky_sim.comparison import channel_errors, initial_state, replay, tracking
from lg_husky_sim.comparison.models import load_plants, NamedPlant, plants_in, unique_labels
from lg_husky_sim.comparison.output import simulate_recording
from lg_husky_sim.husky.effects import Effect, Onset, OnsetKind
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.identification.options import with_effects
from lg_husky_sim.recording import driven_segments, Recording, Segment, segments
from lg_husky_sim.recording.recording import cut
from lg_husky_sim.signals import TimeSeries
from lg_husky_sim.simulation import rollout
import numpy as np
import pytest


def _late(recording: Recording, start: float, *names: str) -> Segment:
    """Return the recording from a time on, with some streams only."""
    streams = {name: recording.streams[name] for name in names}
    end = float(recording.streams['command'].times[-1])
    return Segment('late', 0, start, end, cut(streams, start, end))


@pytest.mark.parametrize('name', ['circle', 's_bend', 'obstacle', 'stop_and_go'])
def test_a_model_replays_its_own_drive(
    name: str, paper: NamedPlant, drive: Callable[[str], Recording],
) -> None:
    (segment,) = segments(drive(name))
    prediction = replay(paper.plant, segment)
    for channel, error in channel_errors(segment, prediction).items():
        assert error.rmse < 2e-3, channel
    assert max(tracking(segment, prediction).bounds) < 2e-3


@pytest.mark.parametrize('name', ['circle', 's_bend'])
def test_a_replay_from_the_midst_of_a_drive(
    name: str, paper: NamedPlant, drive: Callable[[str], Recording],
) -> None:
    segment = _late(drive(name), 8.0, 'command', 'wheels', 'imu', 'pose')
    errors = channel_errors(segment, replay(paper.plant, segment))
    assert errors['wheel_speed'].rmse < 0.05
    assert errors['yaw_rate'].rmse < 0.01
    assert errors['position'].rmse < 0.03


@pytest.mark.parametrize('effects', [
    ('command_latency', 'command_slew'), ('command_slew', 'command_limit')])
def test_a_base_that_starts_in_motion_follows_what_was_commanded(
    effects: tuple[str, ...], paper: NamedPlant,
) -> None:
    """Dead time and limits do not begin with an empty line of commands: it would brake."""
    model = with_effects(paper.model, effects)
    plant = compile_model(model.structure).at(model.parameters.replacing({
        'latency': 0.2} if 'latency' in model.parameters else {'limit_yaw': 0.2}))
    times = 0.1 * np.arange(121.0)
    commands = TimeSeries(times, np.column_stack(
        [0.6 + 0.0 * times, np.where(times < 10.0, 0.5, -0.5)]), ('forward', 'yaw'))
    seen = plant.observe(rollout(plant, commands, 12.0, 0.02))
    recording = Recording('base', 'base', {'command': commands, 'wheels': TimeSeries(
        seen.times, np.column_stack([seen.column('wheel_left'), seen.column('wheel_right')]),
        ('left', 'right'))}, 0)
    whole = replay(plant, segments(recording)[0])
    late = replay(plant, _late(recording, 8.0, 'command', 'wheels'))
    for name in ('wheel_left', 'wheel_right'):
        there = np.interp(late.times, whole.times, whole.column(name))
        np.testing.assert_allclose(late.column(name), there, atol=0.02)


@pytest.mark.parametrize('latency', [0.12, 0.3])
@pytest.mark.parametrize('names', [('pose',), ('imu', 'pose'), ('wheels', 'pose')])
def test_a_robot_at_rest_has_its_dead_time_before_it(
    names: tuple[str, ...], latency: float, paper: NamedPlant,
) -> None:
    """Noise is no motion, and a recording may begin with the first command."""
    model = with_effects(paper.model, ['command_latency'])
    plant = compile_model(model.structure).at(model.parameters.replacing({'latency': latency}))
    times: np.ndarray = 0.05 * np.arange(161)
    commands = TimeSeries(times, np.tile([0.8, 0.0], (161, 1)), ('forward', 'yaw'))
    truth = rollout(plant, commands, 8.0, 0.01)
    random = np.random.default_rng(1)

    def seen(columns: tuple[str, ...], deviation: float) -> np.ndarray:
        values = np.column_stack([np.interp(times, truth.times, truth.column(name))
                                  for name in columns])
        return values + random.normal(0.0, deviation, values.shape)
    streams = {
        'command': commands,
        'pose': TimeSeries(times, seen(('x', 'y', 'heading'), 0.002), ('x', 'y', 'heading')),
        'imu': TimeSeries(times, seen(('yaw_rate', 'accel_x', 'accel_x'), 0.005),
                          ('yaw_rate', 'accel_x', 'accel_y')),
        'wheels': TimeSeries(times, seen(('wheel_left', 'wheel_right'), 0.05),
                             ('left', 'right'))}
    (segment,) = segments(Recording(
        'rest', '', {name: streams[name] for name in ('command', *names)}, 0))
    found = replay(plant, segment)
    assert np.interp(7.9, found.times, found.column('x')) == pytest.approx(
        np.interp(7.9, truth.times, truth.column('x')), abs=0.015)


def test_the_initial_state_in_motion(
    paper: NamedPlant, drive: Callable[[str], Recording],
) -> None:
    recording = drive('circle')
    segment = _late(recording, 12.0, 'command', 'wheels', 'wheel_angles', 'imu', 'pose')
    state = initial_state(segment, paper.plant)
    pose = recording.streams['pose'].slice(12.0, 12.0).values[0]
    assert (state.pose.x, state.pose.y, state.pose.heading) == pytest.approx(pose, abs=0.005)
    assert state.twist.forward == pytest.approx(0.507, abs=0.002)  # steady: 1.01401 · 0.5 m/s
    assert state.twist.yaw == pytest.approx(0.403, abs=0.002)  # 1.00759 · 0.4 rad/s
    wheels = recording.streams['wheels'].slice(12.0, 12.0).values[0]
    assert state.wheel_rates == pytest.approx(wheels, abs=0.01)
    angles = recording.streams['wheel_angles'].slice(12.0, 12.0).values[0]
    assert state.wheel_angles == pytest.approx(angles, abs=0.01)


@pytest.mark.parametrize('names', [('wheels',), ('pose',), ('imu', 'pose')])
def test_speed_and_yaw_rate_from_few_streams(
    names: tuple[str, ...], paper: NamedPlant, drive: Callable[[str], Recording],
) -> None:
    state = initial_state(_late(drive('circle'), 12.0, 'command', *names), paper.plant)
    assert state.twist.forward == pytest.approx(0.507, abs=0.01)
    assert state.twist.yaw == pytest.approx(0.403, abs=0.01)
    assert (state.wheel_rates is None) == ('wheels' not in names)


def test_at_rest_a_noisy_pose_is_averaged(
    paper: NamedPlant, drive: Callable[[str], Recording],
) -> None:
    recording = drive('circle')  # stands for one second
    random = np.random.default_rng(0)
    pose = recording.streams['pose']
    noisy = TimeSeries(pose.times, pose.values + random.normal(0.0, 0.1, pose.values.shape),
                       pose.names)
    streams = {**recording.streams, 'pose': noisy}
    (segment,) = segments(Recording('noisy', '', streams, 0))
    state = initial_state(segment, paper.plant)
    assert abs(state.pose.x) < 0.05
    assert abs(state.pose.y) < 0.05
    assert (state.twist.forward, state.twist.yaw) == (0.0, 0.0)


def test_settings_and_labels(paper: NamedPlant) -> None:
    (heavier,) = load_plants(settings={'mass': 60.0})
    assert (paper.label, heavier.label) == ('paper', 'husky')  # no longer the paper's
    assert heavier.model.parameters['mass'] == 60.0
    assert paper.model.parameters['mass'] == 48.39


def test_labels_are_short_and_differ() -> None:
    paths = [Path('a/fit.yaml'), Path('b/fit.yaml'), Path('b/fit.yaml'), Path('other.yaml')]
    assert unique_labels(paths) == ('a/fit', 'b/fit 1', 'b/fit 2', 'other')
    assert unique_labels([Path('b/fit.yaml')] * 2) == ('fit 1', 'fit 2')


def test_a_name_without_a_file_has_no_folder(paper: NamedPlant) -> None:
    assert unique_labels([Path('paper')] * 2) == ('paper 1', 'paper 2')
    assert unique_labels([Path('paper'), Path('x/paper.yaml')]) == ('paper', 'x/paper')


def test_two_of_the_packaged_models_are_two(paper: NamedPlant) -> None:
    drive = lg.Husky().simulate('spin')
    assert lg.compare(drive, [lg.Husky(), lg.Husky()]).labels == ('paper 1', 'paper 2')


def test_an_onset_belongs_to_its_recording(paper: NamedPlant) -> None:
    effect = Effect('rolling_resistance', late=True)
    structure = Structure().with_effect(effect, Onset(OnsetKind.TIME, 5.0, 'second'))
    parameters = paper.model.parameters.with_entries(
        *(entry.parameter(20.0 if entry.name == 'rolling_force' else None)
          for entry in effect.parameters()))
    late = replace(paper, plant=compile_model(structure).at(parameters))
    names = ['first', 'second', 'third']
    sets = [plants_in([late], name, names)[0].plant for name in names]
    assert [(len(plant.sets), plant.onset is not None) for plant in sets] == [
        (1, False), (2, True), (1, False)]
    assert sets[0].linear  # not begun
    assert not sets[2].linear  # stays
    assert plants_in([paper], 'first', names)[0].plant.linear


def test_commands_are_driven_to_their_end_where_sensors_fall_silent(paper: NamedPlant) -> None:
    """Two seconds of poses, eight of commands: all are driven; what came before is said."""
    stamps = np.linspace(0.0, 8.0, 161)
    commands = TimeSeries(stamps, np.tile([0.5, 0.1], (161, 1)), ('forward', 'yaw'))
    pose = TimeSeries(np.linspace(1.0, 2.98, 100), np.zeros((100, 3)), ('x', 'y', 'heading'))
    recording = Recording('dead', '', {'command': commands, 'pose': pose}, 0)
    parts, left_out = driven_segments(recording)
    assert [(part.start, part.end) for part in parts] == [(1.0, 8.0)]
    assert left_out == 20
    streams = simulate_recording(paper.plant, recording, 1.0)
    assert streams['command'].times[-1] == pytest.approx(8.0)
    assert streams['pose'].times[-1] == pytest.approx(8.0, abs=0.03)
    assert streams['pose'].column('x')[-1] > 2.0
