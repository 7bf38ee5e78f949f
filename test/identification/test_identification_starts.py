# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A dead time from rest and in motion: what was commanded until a segment begins."""

from __future__ import annotations

from dataclasses import replace

from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model, ModelFile
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.identification.estimate import estimate
from lg_husky_sim.identification.fit_segments import FitSegment, PERIOD, segment_for_fit
from lg_husky_sim.identification.options import with_effects
from lg_husky_sim.identification.paper_objective import PaperObjective, track_of
from lg_husky_sim.identification.segment_simulation import simulate_segment
from lg_husky_sim.recording import Segment
from lg_husky_sim.recording.recording import cut
from lg_husky_sim.signals import BodyTwist, TimeSeries
from lg_husky_sim.simulation import rollout, Simulator
from lg_husky_sim.simulation.event_kernel import COLUMNS
import numpy as np
import pytest

FORWARD = COLUMNS.index('forward')
ALL = ('wheels', 'imu', 'pose')


def late_by(latency: float, *effects: str, **values: float) -> tuple[ModelFile, Plant]:
    """Return a model with a dead time that is not known yet, and the robot."""
    model = with_effects(load_model(), ['command_latency', *effects])
    parameters = model.parameters.replacing(values)
    return (ModelFile(model.structure, parameters),
            compile_model(model.structure).at(parameters.replacing({'latency': latency})))


def stint(plant: Plant, forward: float, yaw: float, names: tuple[str, ...] = ALL,
          window: tuple[float, float] = (0.0, 2.5), seed: int = 0, noise: float = 1.0) -> Segment:
    """Return what is recorded of a robot that is told one thing, from rest, at once."""
    times: np.ndarray = 0.05 * np.arange(round(window[1] / 0.05) + 1)
    commands = TimeSeries(times, np.tile([forward, yaw], (times.size, 1)), ('forward', 'yaw'))
    seen = plant.observe(rollout(plant, commands, window[1], 0.02))
    draws = np.random.default_rng(seed)

    def noisy(columns: tuple[str, ...], deviation: float) -> np.ndarray:
        values = np.column_stack([seen.column(c) for c in columns])
        return values + draws.normal(0.0, noise * deviation, values.shape)
    streams = {
        'command': commands,
        'wheels': TimeSeries(seen.times, noisy(('wheel_left', 'wheel_right'), 0.05),
                             ('left', 'right')),
        'imu': TimeSeries(seen.times, noisy(('yaw_rate', 'accel_x', 'accel_x'), 0.005),
                          ('yaw_rate', 'accel_x', 'accel_y')),
        'pose': TimeSeries(seen.times, noisy(('x', 'y', 'heading'), 0.003),
                           ('x', 'y', 'heading'))}
    return Segment(f'{forward:g},{yaw:g}', 0, *window, cut(
        {name: streams[name] for name in ('command', *names)}, *window))


def ready(segment: Segment) -> FitSegment:
    fitted = segment_for_fit(segment)
    assert fitted is not None
    return fitted


@pytest.mark.parametrize('names', [ALL, ('imu', 'pose'), ('wheels',)])
def test_a_dead_time_acts_from_rest_on(names: tuple[str, ...]) -> None:
    """However the recording begins with the first command, as those of a joystick do."""
    _, plant = late_by(0.3)
    segment = ready(stint(plant, 0.8, 0.0, names))
    speed = simulate_segment(Simulator(plant, PERIOD), segment)[:, FORWARD]
    assert np.all(speed[:30] == 0.0)
    assert speed[60] > 0.5


def test_noise_of_the_pose_is_no_motion_where_wheels_stand_still() -> None:
    """A position that is 9 mm off twice makes such a speed of an increment over 0.2 s."""
    _, plant = late_by(0.3)
    noisy = replace(ready(stint(plant, 0.8, 0.0)), twist=BodyTwist(0.09, 0.0),
                    wheel_rates=(0.04, -0.05))
    untold = replace(noisy, commands=TimeSeries(np.zeros(0), np.zeros((0, 2)),
                                                ('forward', 'yaw')))
    told, alone = (simulate_segment(Simulator(plant, PERIOD), one) for one in (noisy, untold))
    np.testing.assert_array_equal(told[:30], alone[:30])
    assert told[60, FORWARD] > alone[60, FORWARD] + 0.4


@pytest.mark.parametrize('names', [ALL, ('imu', 'pose')])
@pytest.mark.parametrize('nuisance', [False, True])
def test_the_dead_time_of_short_drives_from_rest_is_found(names: tuple[str, ...], nuisance: bool
                                                          ) -> None:
    model, plant = late_by(0.12)
    drives = [stint(plant, *told, names, seed=seed) for seed, told in enumerate((
        (0.8, 0.0), (0.5, 0.6), (-0.5, 0.0), (0.0, 0.8), (0.6, -0.4)))]
    fit = estimate(load_model(), drives, nuisance=['latency'], starts=1) if nuisance else (
        estimate(model, drives, starts=1))
    one = next(e for e in fit.estimates if e.name == 'latency')
    assert one.value == pytest.approx(0.12, abs=0.003)
    assert one.high - one.low < 0.01


@pytest.mark.parametrize('latency', [0.0, 0.2])
def test_a_segment_in_motion_goes_on(latency: float) -> None:
    """By a dead time of the base or one of the recording: the line of commands is full."""
    _, plant = late_by(0.2 - latency)
    segment = ready(stint(plant, 0.8, 0.0, window=(3.0, 6.0), noise=0.0))
    speed = simulate_segment(Simulator(plant, PERIOD), segment, latency)[:, FORWARD]
    np.testing.assert_allclose(speed, speed[0], atol=2e-3)


def test_a_limited_base_in_motion_does_not_ramp_down_to_its_limit() -> None:
    """What it followed before was limited, too."""
    _, plant = late_by(0.1, 'command_limit:forward', 'command_slew', limit_forward=0.4,
                       slew_forward=0.2)
    segment = ready(stint(plant, 0.9, 0.0, window=(4.0, 7.0), noise=0.0))
    speed = simulate_segment(Simulator(plant, PERIOD), segment)[:, FORWARD]
    np.testing.assert_allclose(speed, speed[0], atol=2e-3)


@pytest.mark.parametrize('window', [(0.0, 5.0), (10.0, 15.0)])
def test_the_track_of_the_robot_itself(window: tuple[float, float]) -> None:
    """The paper's objective knows dead time from rest, and in motion that there was a before."""
    _, plant = late_by(0.3)
    track = track_of(stint(plant, 0.8, 0.0, window=window, noise=0.0))
    assert track is not None
    assert np.abs(track.simulate(plant) - track.targets).max() < 0.015


def test_wheels_that_were_not_recorded_roll() -> None:
    """With wheels at rest a speed loop would take the base for one that is too slow."""
    model = with_effects(load_model(), ['speed_loop'])
    plant = compile_model(model.structure).at(model.parameters)
    track = track_of(stint(plant, 0.8, 0.0, ('pose',), (10.0, 15.0), noise=0.0))
    assert track is not None
    assert track.wheel_rates is None
    assert np.abs(track.simulate(plant) - track.targets).max() < 0.015


def test_a_start_in_motion_is_the_same_for_one_candidate_and_for_many() -> None:
    """Exactly for the given parameters, and as far as it is remembered for others."""
    husky = load_model()
    compiled = compile_model(husky.structure)
    drive = stint(compiled.at(husky.parameters), 0.8, 0.4, ('pose',), (10.0, 15.0), noise=0.0)
    objective = PaperObjective(compiled, husky.parameters, ('wheel_damping',), [drive])
    assert objective.batched
    values = np.array([[husky.parameters['wheel_damping']], [10.0]])
    alone = [objective._single(row) for row in values]
    assert objective(values)[0] == pytest.approx(alone[0], rel=1e-9)
    assert objective(values) == pytest.approx(alone, rel=0.01)
