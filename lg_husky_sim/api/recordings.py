# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings as a user handles them: read, looked at, drawn, written."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from numbers import Integral
import os
from pathlib import Path
from typing import Any, TYPE_CHECKING, TypeAlias

from lg_husky_sim import recording as rec
from lg_husky_sim.api.axes import axes_or_new
from lg_husky_sim.api.progress import Report
from lg_husky_sim.api.tables import page_part, Table
from lg_husky_sim.errors import CommandError, RecordingError
from lg_husky_sim.extras import require
from lg_husky_sim.recording.bags import bags_in
from lg_husky_sim.signals import TimeSeries
from lg_husky_sim.yaml_files import shown
import numpy as np

if TYPE_CHECKING:
    from lg_husky_sim.api.robots import Husky
    from lg_husky_sim.api.surveys import Survey

PathLike: TypeAlias = str | os.PathLike[str]
Topics: TypeAlias = Mapping[str, str] | rec.TopicMap | None


class Recording(rec.Recording):
    """
    One recorded or simulated drive, all streams on one clock.

    Every stream is a :class:`~lg_husky_sim.signals.TimeSeries` with ``times`` [s] since the start,
    ``values`` of shape (n_times, n_channels), ``column(name)``, ``to_pandas()`` and ``plot(ax)``.
    SI units and radians; positive yaw turns to the left (REP-103). One that was not recorded
    raises ``RecordingError``; ``streams`` is a mapping of those there are.
    """

    @classmethod
    def of(cls, other: rec.Recording) -> Recording:
        """Return another recording as one of this class."""
        return other if isinstance(other, cls) else cls(
            **{field.name: getattr(other, field.name) for field in fields(other)})

    @property
    def command(self) -> TimeSeries:
        """Commanded forward speed [m/s] and yaw rate [rad/s], columns forward and yaw."""
        return self.stream('command')

    @property
    def wheels(self) -> TimeSeries:
        """Wheel rates [rad/s], mean of a side, columns left and right."""
        return self.stream('wheels')

    @property
    def wheel_angles(self) -> TimeSeries:
        """Wheel angles [rad], mean of a side, columns left and right."""
        return self.stream('wheel_angles')

    @property
    def wheel_torques(self) -> TimeSeries:
        """Torque of a wheel [N·m], mean of a side, columns left and right."""
        return self.stream('wheel_torques')

    @property
    def imu(self) -> TimeSeries:
        """Columns yaw_rate [rad/s], accel_x and accel_y [m/s²]."""
        return self.stream('imu')

    @property
    def pose(self) -> TimeSeries:
        """Columns x, y [m] and heading [rad], not wrapped."""
        return self.stream('pose')

    @property
    def currents(self) -> TimeSeries:
        """Motor currents [A], columns left and right."""
        return self.stream('currents')

    @property
    def voltage(self) -> TimeSeries:
        """Voltage of the supply [V], column bus."""
        return self.stream('voltage')

    @property
    def segments(self) -> tuple[rec.Segment, ...]:
        """Stretches without a gap in command, wheels, imu or pose."""
        return rec.segments(self)

    def info(self, model: Husky | PathLike | None = None) -> Survey:
        """
        Say what the recording holds and what it is good for, before any fit.

        Parameters
        ----------
        model : Husky or path-like, optional
            Whose parameters the recording shall determine; the packaged Husky by default.

        Returns
        -------
        Survey
            Streams with rates and gaps, repairs of the clock, excitation, which parameters the
            drive can determine, and what is missing for a diagnosis.

        """
        from lg_husky_sim.api.surveys import survey
        return survey(self, model)

    def to_pandas(self) -> Any:
        """
        Return all streams as one pandas DataFrame.

        Returns
        -------
        pandas.DataFrame
            Index ``time`` [s], columns such as ``wheels.left``; NaN where a stream has no sample
            at a time.

        """
        require('pandas', 'make a DataFrame')
        import pandas as pd

        frames = []
        for name, series in self.streams.items():
            frame = series.to_pandas().add_prefix(f'{name}.')
            frames.append(frame[~frame.index.duplicated(keep='last')])
        return pd.concat(frames, axis=1).sort_index() if frames else pd.DataFrame()

    def plot(self, axes: Sequence[Any] | None = None, label: str = '') -> Any:
        """
        Draw the drive: path, forward command, wheel rates and yaw rate.

        Parameters
        ----------
        axes : sequence of four matplotlib Axes, optional
            Where to draw; a new figure if not given.
        label : str
            Put before the names in the legends, to tell several recordings apart.

        Returns
        -------
        numpy.ndarray of matplotlib Axes, shape (4,)

        """
        axes = axes_or_new(axes, (2, 2), 'a recording', (10.0, 6.0))
        prefix = f'{label} ' if label else ''
        path, speed, wheels, turn = axes
        if 'pose' in self.streams:
            path.plot(self.pose.column('x'), self.pose.column('y'), label=f'{prefix}path')
        path.set_aspect('equal', adjustable='datalim')
        path.set(title='Path', xlabel='x [m]', ylabel='y [m]')
        for axis, stream, channel, name in (
                (speed, 'command', 'forward', 'commanded'), (turn, 'command', 'yaw', 'commanded'),
                (wheels, 'wheels', 'left', 'left'), (wheels, 'wheels', 'right', 'right'),
                (turn, 'imu', 'yaw_rate', 'gyro')):
            if stream in self.streams:
                series = self.streams[stream]
                drawn = 'steps-post' if stream == 'command' else 'default'
                axis.plot(series.times, series.column(channel), label=prefix + name, lw=1.0,
                          drawstyle=drawn)
        for axis, title, unit in ((speed, 'Forward speed', 'm/s'),
                                  (wheels, 'Wheel rates', 'rad/s'), (turn, 'Yaw rate', 'rad/s')):
            axis.set(title=title, xlabel='time [s]', ylabel=unit)
        for axis in axes:
            if axis.get_legend_handles_labels()[0]:
                axis.legend()
        return np.array(list(axes), dtype=object)

    def save(self, path: PathLike, *, storage: str = 'mcap', overwrite: bool = False) -> Path:
        """
        Write the recording as a rosbag2.

        Parameters
        ----------
        path : path-like
            Folder to make.
        storage : str
            ``mcap`` or ``sqlite3``.
        overwrite : bool
            Replace a rosbag2 that is there; anything else is never touched.

        Returns
        -------
        pathlib.Path

        Raises
        ------
        RecordingError
            If something is at `path` already.

        """
        frames = self.frames if self.frames[0] else ('odom', 'base_link')
        return rec.write_recording(path, self.streams, storage=storage, start_ns=self.start_ns,
                                   frames=frames, overwrite=overwrite)

    def save_tum(self, path: PathLike) -> Path:
        """
        Write the pose as a trajectory in the TUM format, which evo reads.

        Parameters
        ----------
        path : path-like
            Replaced if such a file is there.

        Returns
        -------
        pathlib.Path
            Lines of ``stamp x y z qx qy qz qw``, stamps [s] of the recording's own clock.

        Raises
        ------
        RecordingError
            If the recording has no pose.
        SettingsError
            If something else is there.

        """
        from lg_husky_sim.recording.tum import write_tum
        return write_tum(path, self.pose, self.start_ns)

    def table(self) -> Table:
        """Return the streams with samples, rate and length as a table."""
        return Table('', ('stream', 'channels', 'samples', 'rate [Hz]', 'from [s]', 'to [s]'),
                     tuple((name, ', '.join(series.names), len(series), rate(series),
                            float(series.times[0]) if len(series) else None,
                            float(series.times[-1]) if len(series) else None)
                           for name, series in self.streams.items()))

    def __repr__(self) -> str:
        """Name the recording, its length and its streams."""
        return f'<Recording {self.name}: {self.duration:.1f} s, {", ".join(self.streams)}>'

    def _repr_html_(self) -> str:
        return page_part(f'Recording {self.name}', [f'{self.duration:.1f} s, {self.path}'],
                         [self.table()], {'Notes': self.notes})


Recordings: TypeAlias = PathLike | rec.Recording | Iterable[PathLike | rec.Recording]


def rate(series: TimeSeries) -> float | None:
    """Return the usual rate of a series [Hz], from its median interval."""
    steps = np.diff(series.times)
    steps = steps[steps > 0.0]
    return float(1.0 / np.median(steps)) if steps.size else None


def topic_map(topics: Topics) -> rec.TopicMap:
    """Return topics chosen by hand as the reader takes them."""
    if isinstance(topics, rec.TopicMap):
        return topics
    if not isinstance(topics, (Mapping, type(None))):
        raise RecordingError(f'topics = {shown(topics)} is no mapping of roles to topics')
    return rec.TopicMap.parse(f'{role}={name}' for role, name in (topics or {}).items())


def read(path: PathLike, *, topics: Topics = None) -> Recording:
    """
    Read a ROS bag; no ROS is needed.

    Parameters
    ----------
    path : path-like
        A rosbag2 folder, an .mcap or .db3 file, or a ROS 1 .bag file.
    topics : mapping of str to str, optional
        Topics and frames chosen by hand, by role: command, wheels, imu, pose, current_left,
        current_right, voltage, status, odom_frame, base_frame, left_wheels, right_wheels.

    Returns
    -------
    Recording

    Raises
    ------
    RecordingError
        If there is no usable bag; the message says why.

    """
    bags = bags_in(_place(path))
    if len(bags) > 1:
        names = ', '.join(bag.name for bag in bags[:5])
        raise RecordingError(f'{path} holds {len(bags)} recordings ({names}'
                             f'{", …" if len(bags) > 5 else ""}): use read_all')
    return Recording.of(rec.read_recording(bags[0], topic_map(topics)))


def read_all(source: Recordings, *, topics: Topics = None, progress: Report | None = None
             ) -> list[Recording]:
    """
    Read several bags.

    Parameters
    ----------
    source : path-like, Recording, or several of them
        A folder of bags stands for all of them, in the order of their names. Recordings are
        passed on.
    topics : mapping of str to str, optional
        As :func:`read` takes them.
    progress : callable, optional
        Told each recording before it is read.

    Returns
    -------
    list of Recording

    Raises
    ------
    RecordingError
        If one of them is no usable bag.

    """
    chosen = topic_map(topics)
    several = listed(source)
    found = []
    for number, one in enumerate(several):
        if isinstance(one, rec.Recording):
            found.append(Recording.of(one))
            continue
        if progress is not None:
            progress(f'reading {one.name}', number / len(several))
        found.append(Recording.of(rec.read_recording(one, chosen)))
    return found


def given(source: Recordings) -> list[Path | rec.Recording]:
    """
    Return what is to be read as :func:`listed` does, which must be something.

    Raises
    ------
    RecordingError
        If there is none, or a path does not exist.

    """
    found = listed(source)
    if not found:
        raise RecordingError('no recording given')
    return found


def check_seed(seed: object) -> None:
    """Check a seed of random numbers."""
    if isinstance(seed, bool) or not isinstance(seed, Integral) or seed < 0:
        raise CommandError(f'seed = {shown(seed)}: a whole number of at least 0 is needed')


def check_count(name: str, value: object) -> None:
    """
    Check how many processes, threads or starts are asked for.

    Raises
    ------
    CommandError
        If fewer than one.

    """
    if not isinstance(value, Integral) or value < 1:
        raise CommandError(f'{name} = {shown(value)}: at least 1 is needed')


def listed(source: Recordings) -> list[Path | rec.Recording]:
    """
    Return what is to be read, and recordings that are there already; nothing is read.

    Raises
    ------
    RecordingError
        If a path does not exist.

    """
    several: Iterable[PathLike | rec.Recording] = source if isinstance(
        source, Iterable) and not isinstance(source, str) else [source]
    found: list[Path | rec.Recording] = []
    for one in several:
        if isinstance(one, rec.Recording):
            found.append(one)
            continue
        place = _place(one)
        if not place.exists():
            raise RecordingError(f'no recording {one}: there is no such file or folder')
        found += bags_in(place)
    return found


def _place(path: object) -> Path:
    if not isinstance(path, (str, os.PathLike)):
        raise RecordingError(f'{shown(path)} is no recording, nor the path of one')
    if not os.fspath(path):
        raise RecordingError("'' is no recording: the path is empty")
    return Path(path)
