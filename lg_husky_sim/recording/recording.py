# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What was recorded, as named time series, and its stretches without a gap."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np

CHANNELS: Mapping[str, tuple[str, ...]] = MappingProxyType({
    'command': ('forward', 'yaw'),
    'wheels': ('left', 'right'),
    'wheel_angles': ('left', 'right'),
    'wheel_torques': ('left', 'right'),
    'imu': ('yaw_rate', 'accel_x', 'accel_y'),
    'pose': ('x', 'y', 'heading'),
    'currents': ('left', 'right'),
    'voltage': ('bus',),
})
"""Names of the channels of each stream; units: m/s, rad/s, rad, N·m, m/s², m, A, V."""

CONTINUOUS = ('command', 'wheels', 'imu', 'pose')
"""Streams whose gaps end a segment."""

DEFAULT_GAP = 0.5
"""Longest silence [s] of a stream within one segment."""


@dataclass(frozen=True, eq=False)
class Recording:
    """
    One recorded drive, all streams on one clock.

    Parameters
    ----------
    name : str
        Short name: the bag's file or folder name.
    path : str
        Where it was read from.
    streams : mapping of str to TimeSeries
        Those of ``CHANNELS`` that were recorded; times [s] since `start_ns`.
    start_ns : int
        Time zero of the streams [ns since the epoch of the recording's clock].
    topics : mapping of str to str
        Topic that each stream was read from.
    frames : tuple of str
        Parent and child frame of the stream ``pose``; empty strings without one.
    present : mapping of str to str
        Every topic in the bag with its message type.
    notes : tuple of str
        What had to be repaired or left out, in plain words.

    """

    name: str
    path: str
    streams: Mapping[str, TimeSeries]
    start_ns: int
    topics: Mapping[str, str] = field(default_factory=dict)
    frames: tuple[str, str] = ('', '')
    present: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the streams' channels and freeze the mappings."""
        for name, series in self.streams.items():
            check_stream(name, series)
        for attribute in ('streams', 'topics', 'present'):
            object.__setattr__(
                self, attribute, MappingProxyType(dict(getattr(self, attribute))))

    def stream(self, name: str) -> TimeSeries:
        """
        Return one stream.

        Parameters
        ----------
        name : str
            A key of ``CHANNELS``.

        Returns
        -------
        TimeSeries

        Raises
        ------
        RecordingError
            If it was not recorded; the message lists what was.

        """
        if name not in self.streams:
            there = ', '.join(f'{topic} ({kind})' for topic, kind in sorted(self.present.items()))
            raise RecordingError(
                f'recording {self.name} has no {name}; streams: '
                f'{", ".join(self.streams) or "none"}; topics: {there or "none"}')
        return self.streams[name]

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        times = [series.times[[0, -1]] for series in self.streams.values() if len(series)]
        return float(max(t[1] for t in times) - min(t[0] for t in times)) if times else 0.0


@dataclass(frozen=True, eq=False)
class Segment:
    """
    A stretch of a recording without a gap; its initial state is unknown.

    Parameters
    ----------
    recording : str
        Name of the recording.
    index : int
        Number within the recording, from 0.
    start, end : float
        Bounds [s] on the recording's clock.
    streams : mapping of str to TimeSeries
        The recording's streams within the bounds, times on the recording's clock. The command
        that holds at `start` is its first row, even when it was sent before.

    """

    recording: str
    index: int
    start: float
    end: float
    streams: Mapping[str, TimeSeries]

    def __post_init__(self) -> None:
        """Freeze the mapping."""
        object.__setattr__(self, 'streams', MappingProxyType(dict(self.streams)))

    @property
    def duration(self) -> float:
        """Length [s]."""
        return self.end - self.start


def check_stream(name: str, series: TimeSeries) -> None:
    """
    Check that a stream is known and has its channels.

    Raises
    ------
    RecordingError
        If it is unknown, or its channels are others.

    """
    if name not in CHANNELS:
        raise RecordingError(f'unknown stream {name!r}; known are {", ".join(CHANNELS)}')
    if series.names != CHANNELS[name]:
        raise RecordingError(
            f'stream {name} has channels {", ".join(series.names)}; '
            f'it must have {", ".join(CHANNELS[name])}')


def segments(recording: Recording, gap: float = DEFAULT_GAP) -> tuple[Segment, ...]:
    """
    Cut a recording at its gaps.

    A segment is a stretch in which command, wheels, imu and pose, as far as they were recorded,
    all keep sending: none is silent for longer than `gap`, or than three of its own median
    intervals where it is slower. Stretches shorter than `gap`, or with fewer than two samples
    of one of these streams, are left out.

    Parameters
    ----------
    recording : Recording
        With any of the streams, on one clock.
    gap : float
        Longest silence within a segment [s], positive.

    Returns
    -------
    tuple of Segment
        In order of time; empty if the streams never overlap.

    Raises
    ------
    RecordingError
        If `gap` is not positive.

    """
    if not gap > 0.0:
        raise RecordingError(f'gap = {gap} s must be positive')
    watched = [recording.streams[name] for name in CONTINUOUS if name in recording.streams]
    stretches: list[tuple[float, float]] = [(-np.inf, np.inf)]
    for series in watched:
        stretches = _overlaps(stretches, _stretches(series.times, gap))
    found: list[Segment] = []
    for start, end in stretches:
        if not np.isfinite(start) or end - start < gap:
            continue
        parts = cut(recording.streams, start, end)
        if all(name in parts and len(parts[name]) >= 2
               for name in CONTINUOUS if name in recording.streams):
            found.append(Segment(recording.name, len(found), start, end, parts))
    return tuple(found)


def driven_segments(recording: Recording, gap: float = DEFAULT_GAP
                    ) -> tuple[tuple[Segment, ...], int]:
    """
    Cut a recording for driving its commands to their end, whatever its sensors do.

    Parameters
    ----------
    recording : Recording
        With a stream ``command``.
    gap : float
        Longest silence of the commands within a segment [s], positive.

    Returns
    -------
    tuple of Segment
        Those of :func:`segments`, each going on to the next one's start or to the end of its
        commands: only a gap of the commands ends it.
    int
        Commands that are left out: no state of the robot is known before they were given.

    """
    found, commands = segments(recording, gap), recording.streams['command']
    extended: list[Segment] = []
    covered = 0
    for first, last in _stretches(commands.times, gap):
        inside = [part for part in found if first <= part.start <= last]
        for k, part in enumerate(inside):
            end = inside[k + 1].start if k + 1 < len(inside) else max(last, part.end)
            extended.append(Segment(part.recording, len(extended), part.start, end,
                                    cut(recording.streams, part.start, end)))
        if inside:
            # The last one before the start is in force there.
            begin = np.searchsorted(commands.times, inside[0].start, side='right') - 1
            covered += int(np.searchsorted(commands.times, last, side='right')) - max(
                int(begin), 0)
    return tuple(extended), len(commands) - covered


def windows(segment: Segment, length: float) -> tuple[Segment, ...]:
    """
    Cut a segment into windows of one length.

    Parameters
    ----------
    segment : Segment
        To be cut from its start on.
    length : float
        Length of a window [s], positive.

    Returns
    -------
    tuple of Segment
        Numbered from 0 within the segment; the rest at the end is one of them when it is at
        least half as long. A segment shorter than that is returned whole.

    Raises
    ------
    RecordingError
        If `length` is not positive.

    """
    if not length > 0.0:
        raise RecordingError(f'length = {length} s of a window must be positive')
    count = max(1, int(np.floor(segment.duration / length + 0.5)))
    edges = [segment.start + k * length for k in range(count)]
    ends = [*edges[1:], min(edges[-1] + length, segment.end) if count > 1 else segment.end]
    return tuple(Segment(segment.recording, k, start, end, cut(segment.streams, start, end))
                 for k, (start, end) in enumerate(zip(edges, ends, strict=True)))


def cut(
    streams: Mapping[str, TimeSeries], start: float, end: float,
) -> dict[str, TimeSeries]:
    """
    Return the streams within bounds; those without a sample there are left out.

    Parameters
    ----------
    streams : mapping of str to TimeSeries
        By name, each in the order of time [s].
    start, end : float
        Bounds [s], both inclusive. The command that holds at `start` becomes its first row.

    Returns
    -------
    dict of str to TimeSeries

    """
    parts = {name: _part(name, series, start, end) for name, series in streams.items()}
    return {name: part for name, part in parts.items() if len(part)}


def _stretches(times: FloatArray, gap: float) -> list[tuple[float, float]]:
    """Return the intervals in which one stream keeps sending."""
    if times.size == 0:
        return []
    steps = np.diff(times)
    longest = max(gap, 3.0 * float(np.median(steps))) if steps.size else gap
    cuts = np.flatnonzero(steps > longest)
    starts = np.concatenate(([0], cuts + 1))
    ends = np.concatenate((cuts, [times.size - 1]))
    return [(float(times[a]), float(times[b])) for a, b in zip(starts, ends, strict=True)]


def _overlaps(
    first: list[tuple[float, float]], second: list[tuple[float, float]],
) -> list[tuple[float, float]]:
    """Intersect two ordered lists of disjoint intervals."""
    found: list[tuple[float, float]] = []
    i = j = 0
    while i < len(first) and j < len(second):
        start, end = max(first[i][0], second[j][0]), min(first[i][1], second[j][1])
        if start < end:
            found.append((start, end))
        if first[i][1] < second[j][1]:
            i += 1
        else:
            j += 1
    return found


def _part(name: str, series: TimeSeries, start: float, end: float) -> TimeSeries:
    """Slice a stream; a command is held from before the start."""
    part = series.slice(start, end)
    if name != 'command' or (len(part) and part.times[0] == start):
        return part
    before = int(np.searchsorted(series.times, start, side='right')) - 1
    if before < 0:
        return part
    return TimeSeries(
        np.concatenate(([start], part.times)),
        np.concatenate((series.values[before:before + 1], part.values)),
        series.names)
