# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What the evaluation is made on: a synthetic robot, an engine's, or recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import Any

from lg_husky_sim.errors import CommandError
from lg_husky_sim.evaluation.engine import drive, engine_config, engine_robot
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.manoeuvres import find_manoeuvre
from lg_husky_sim.recording import named_apart, read_recording, Recording, TopicMap
from lg_husky_sim.signals import TimeSeries
from lg_husky_sim.simulation import rollout
import numpy as np

#: The paper's manoeuvres; the first one calibrates, the others are held out.
MANOEUVRES = ('circle', 's_bend', 'obstacle')
#: Time zero of a synthetic recording [ns].
EPOCH = 1_700_000_000_000_000_000


@dataclass(frozen=True)
class Case:
    """
    A robot, driven through manoeuvres.

    Parameters
    ----------
    name, about : str
    recordings : mapping of str to Recording
        By manoeuvre; the first one calibrates.
    rivals : mapping of str to Recording
        The engine's nominal run of the same commands, by manoeuvre.
    rival_label : str

    """

    name: str
    about: str
    recordings: Mapping[str, Recording]
    rivals: Mapping[str, Recording] = field(default_factory=dict)
    rival_label: str = 'engine'


def synthetic_case(seed: int) -> Case:
    """
    Return a robot that is the paper's graph with other numbers, and noisy sensors.

    Parameters
    ----------
    seed : int
        Of the sensors' noise.

    """
    config = engine_config()
    model = load_model()
    plant = compile_model(model.structure).at(model.parameters.replacing(config['truth']))
    draws = np.random.default_rng(seed)
    recordings = {}
    for name in MANOEUVRES:
        commands = find_manoeuvre(name).commands()
        period = 1.0 / float(config['sensors']['rate'])
        truth = plant.observe(rollout(plant, commands, float(commands.times[-1]), period))
        recordings[name] = sensed(name, commands, truth, draws, config['sensors'])
    # The engine stands beside it where it is installed; nothing else here needs it.
    rivals = _nominal_runs() if find_spec('mujoco') is not None else {}
    return Case('synthetic', "the paper's graph with other parameters, and sensor noise",
                recordings, rivals, 'engine, nominal')


def engine_case(seed: int) -> Case:
    """
    Return a robot in the engine that differs from the nominal one, and noisy sensors.

    Parameters
    ----------
    seed : int
        Of the sensors' noise; not the same noise as of the synthetic case.

    """
    config = engine_config()
    draws = np.random.default_rng(seed + 1)
    robot = engine_robot('robot')
    recordings = {}
    for name in MANOEUVRES:
        commands = find_manoeuvre(name).commands()
        truth = drive(robot, commands, float(config['sensors']['rate']))
        recordings[name] = sensed(name, commands, truth, draws, config['sensors'])
    return Case('engine', 'a rigid-body engine in the part of the robot: other ground, losses, '
                'masses and speed loop than its nominal model', recordings, _nominal_runs(),
                'engine, nominal')


def _nominal_runs() -> dict[str, Recording]:
    robot, rate = engine_robot('nominal'), float(engine_config()['sensors']['rate'])
    runs = {}
    for name in MANOEUVRES:
        commands = find_manoeuvre(name).commands()
        runs[name] = _recording(name, commands, drive(robot, commands, rate))
    return runs


def recorded_case(calibrate: Sequence[str], held_out: Sequence[str], rivals: Sequence[str],
                  topics: TopicMap | None = None) -> Case:
    """
    Return recordings as a case.

    Parameters
    ----------
    calibrate : sequence of str
        Exactly one recording to calibrate on.
    held_out : sequence of str
        Recordings to predict, any number.
    rivals : sequence of str
        Another simulator's recordings of the same drives, in the order of the two before; or
        none.
    topics : TopicMap, optional
        Of the recordings, where they are chosen by hand; not of the rivals.

    Raises
    ------
    CommandError
        If the numbers do not agree.
    RecordingError
        If one cannot be read or is given twice.

    """
    if len(calibrate) != 1:
        raise CommandError(f'{len(calibrate)} recordings to calibrate on; give exactly one')
    paths = [*calibrate, *held_out]
    if rivals and len(rivals) != len(paths):
        raise CommandError(f'{len(rivals)} rivals for {len(paths)} recordings: give one for each '
                           'recording, in their order, or none')
    read, = named_apart([read_recording(path, topics) for path in paths])
    names = [recording.name for recording in read]
    others = {name: read_recording(path) for name, path in zip(names, rivals, strict=False)}
    return Case('recorded', 'recordings', dict(zip(names, read, strict=True)), others, 'rival')


def sensed(name: str, commands: TimeSeries, truth: TimeSeries, draws: np.random.Generator,
           sensors: Mapping[str, Any]) -> Recording:
    """
    Return what noisy sensors record of a drive.

    Parameters
    ----------
    name : str
        Of the recording.
    commands : TimeSeries
        Names forward [m/s], yaw [rad/s].
    truth : TimeSeries
        Columns wheel_left, wheel_right, yaw_rate, accel_x, x, y and heading.
    draws : numpy.random.Generator
        Where the noise comes from; it is advanced.
    sensors : mapping
        Standard deviations: wheel, gyro, acceleration, position, heading.

    """
    shape = (len(truth), 1)

    def noise(kind: str, columns: int = 1) -> Any:
        return draws.normal(0.0, float(sensors[kind]), (shape[0], columns))
    values = np.array(truth.values)
    column = {one: place for place, one in enumerate(truth.names)}
    values[:, [column['wheel_left'], column['wheel_right']]] += noise('wheel', 2)
    values[:, [column['yaw_rate']]] += noise('gyro')
    values[:, [column['accel_x']]] += noise('acceleration')
    values[:, [column['x'], column['y']]] += noise('position', 2)
    values[:, [column['heading']]] += noise('heading')
    return _recording(name, commands, TimeSeries(truth.times, values, truth.names))


def _recording(name: str, commands: TimeSeries, seen: TimeSeries) -> Recording:
    def stream(columns: Sequence[str], names: tuple[str, ...]) -> TimeSeries:
        return TimeSeries(seen.times, np.column_stack([seen.column(c) for c in columns]), names)
    forward = seen.column('forward')
    sideways = TimeSeries(seen.times, (forward * seen.column('yaw_rate'))[:, None], ('a',))
    imu = np.column_stack([seen.column('yaw_rate'), seen.column('accel_x'), sideways.values])
    return Recording(name, name, {
        'command': commands,
        'wheels': stream(('wheel_left', 'wheel_right'), ('left', 'right')),
        'imu': TimeSeries(seen.times, imu, ('yaw_rate', 'accel_x', 'accel_y')),
        'pose': stream(('x', 'y', 'heading'), ('x', 'y', 'heading')),
    }, EPOCH)
