# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A model driven with whatever the user has as commands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import os
from pathlib import Path
from typing import Any, TypeAlias

from lg_husky_sim import recording as rec
from lg_husky_sim.api.recordings import PathLike, Recording, topic_map, Topics
from lg_husky_sim.comparison.output import DEFAULT_RATE, simulate_commands, simulate_recording
from lg_husky_sim.errors import CommandError
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.manoeuvres import checked_rate, find_manoeuvre, load_manoeuvre, Manoeuvre
from lg_husky_sim.recording.writer import START_NS
from lg_husky_sim.signals import TimeSeries
import numpy as np

Drive: TypeAlias = PathLike | rec.Recording | Manoeuvre | TimeSeries | Any
"""What `Husky.simulate` takes as commands."""

_COLUMNS = ('forward', 'yaw')


def driven(plant: Plant, values: Mapping[str, float], commands: Drive, rate: float | None = None,
           topics: Topics = None) -> Recording:
    """
    Drive a plant and return what its sensors read.

    Parameters
    ----------
    plant : Plant
        Robot to drive, with its sensors.
    values : mapping of str to float
        Its parameters: torque_constant and gear_ratio are needed.
    commands : path-like, str, Recording, Manoeuvre, TimeSeries, DataFrame or arrays
        Recording or manoeuvre to follow, or speeds [m/s] and yaw rates [rad/s] over time [s].
    rate : float, optional
        Samples per second [Hz].
    topics : mapping of str to str, optional
        Topics of the recording chosen by hand; of a recording only.

    Returns
    -------
    Recording

    Raises
    ------
    CommandError
        If the commands cannot be used, or the rate is too low for two samples.
    RecordingError
        If the recording cannot be read or has no commands.

    """
    if rate is not None:
        checked_rate(rate)
    torque = values['torque_constant'] * values['gear_ratio']
    recording = _recording(plant, commands, topics)
    if recording is not None:
        frames = recording.frames if recording.frames[0] else ('odom', 'base_link')
        streams = _sampled(simulate_recording(plant, recording, torque, rate or 0.0), rate)
        _, left_out = rec.driven_segments(recording)
        notes = () if not left_out else (
            f'{left_out} of {len(recording.stream("command"))} commands are not driven: no state '
            'of the robot is known before they were given',)
        return Recording(recording.name, '', streams, recording.start_ns,
                         frames=frames, notes=notes)
    name, series = _series(commands, topics)
    streams = _sampled(simulate_commands(plant, series, torque, rate or DEFAULT_RATE), rate)
    return Recording(name, '', streams, START_NS, frames=('odom', 'base_link'))


def _sampled(streams: dict[str, TimeSeries], rate: float | None) -> dict[str, TimeSeries]:
    if rate and len(streams['pose']) < 2:
        raise CommandError(f'rate = {rate:g} Hz gives a single sample of the whole drive')
    return streams


def fastest_side(commands: TimeSeries, values: Mapping[str, float]) -> float:
    """
    Return the largest speed that commands ask of the wheels of a side [m/s].

    Parameters
    ----------
    commands : TimeSeries
        Names forward [m/s] and yaw [rad/s].
    values : mapping of str to float
        Parameters of the model: turn_ratio is needed.

    """
    if not len(commands):
        return 0.0
    forward, turn = np.abs(commands.column('forward')), np.abs(commands.column('yaw'))
    return float(np.max(forward + values['turn_ratio'] * turn))


def _recording(plant: Plant, commands: Drive, topics: Topics) -> rec.Recording | None:
    if isinstance(commands, (str, os.PathLike)) and is_recording(commands):
        read: rec.Recording = rec.read_recording(commands, topic_map(topics))
    elif isinstance(commands, rec.Recording):
        read = commands
    else:
        return None
    known = () if plant.onset is None else plant.onset.recordings
    named, = rec.named_as_in([read], known)
    return named


def is_recording(commands: PathLike) -> bool:
    """Tell a recording from a script or a built-in name: by what is there, then by ending."""
    path = Path(commands)
    return (path.is_dir() or path.name == 'metadata.yaml'
            or path.suffix in ('.mcap', '.db3', '.bag'))


def _series(commands: Drive, topics: Topics) -> tuple[str, TimeSeries]:
    if topic_map(topics) != rec.TopicMap():
        raise CommandError('topics can only be chosen for a recording, and '
                           f'{_shown(commands)} is none')
    if isinstance(commands, Manoeuvre):
        return commands.name, commands.commands()
    if isinstance(commands, (str, os.PathLike)):
        script = _script(os.fspath(commands))
        return script.name, script.commands()
    if isinstance(commands, TimeSeries):
        return 'commands', TimeSeries(commands.times, np.column_stack(
            [commands.column(name) for name in _COLUMNS]), _COLUMNS)
    return 'commands', _from_arrays(commands)


def _shown(commands: Drive) -> str:
    return os.fspath(commands) if isinstance(commands, (str, os.PathLike)) else (
        type(commands).__name__)


def _script(commands: str) -> Manoeuvre:
    path = Path(commands)
    if path.suffix in ('.yaml', '.yml') or path.is_file():
        return load_manoeuvre(path)
    if len(path.parts) > 1:
        raise CommandError(f'no recording or command script {commands}: there is no such file')
    return find_manoeuvre(commands)


def _from_arrays(commands: Any) -> TimeSeries:
    if hasattr(commands, 'columns') and hasattr(commands, 'index'):  # a DataFrame
        missing = [name for name in _COLUMNS if name not in commands.columns]
        if missing:
            raise CommandError(f'the DataFrame has no column {missing[0]!r}; it must have the '
                               'columns forward [m/s] and yaw [rad/s], and times [s] as index')
        parts: Sequence[Any] = (commands.index, commands['forward'], commands['yaw'])
    else:
        parts = commands
    try:
        table = np.asarray(parts, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise CommandError(f'commands of type {type(commands).__name__} are none: give a '
                           'recording, a manoeuvre, or times, forward speeds and yaw rates as '
                           'arrays of one length') from error
    if table.ndim == 2 and table.shape[0] == 3 and isinstance(parts, (tuple, list)):
        table = table.T
    if table.ndim != 2 or table.shape[1] != 3 or table.shape[0] < 2:
        raise CommandError(f'commands of shape {table.shape} must be three arrays of one length, '
                           'or one of shape (n, 3): times [s], forward speeds [m/s] and yaw '
                           'rates [rad/s], at least two rows')
    if not np.all(np.isfinite(table)):
        raise CommandError('commands must be finite numbers')
    if np.any(np.diff(table[:, 0]) < 0.0):
        raise CommandError('times of commands must not decrease')
    return TimeSeries(table[:, 0], table[:, 1:], _COLUMNS)
