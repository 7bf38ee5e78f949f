# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
One clock for all streams, from header stamps and log times.

A header stamp says when something was measured, the log time when the recorder received it.
Headers are better where they are there and make sense; some messages (Twist, Float32) have none,
some drivers leave them zero, and some sensors count from their own start.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from lg_husky_sim.errors import RecordingError
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

IntArray = NDArray[np.int64]

MAIN = ('command', 'wheels', 'imu')
"""Streams that tell how the robot moves, with the transforms of its pose."""

NEIGHBOURS = 11
"""Messages that a header stamp is held against."""
OUTLIER_NS = 1_000_000_000
"""A header this far from its neighbours' delay is wrong."""
SKEW_NS = 500_000_000
"""Two clocks this far apart are different clocks."""
FOREIGN_NS = 10 * SKEW_NS
"""No sensor takes this long before it sends."""
LONGEST_NS = 30 * 86_400 * 1_000_000_000
"""No recording is longer; a longer one has damaged stamps."""


@dataclass(frozen=True)
class Stamps:
    """
    Stamps of one stream's messages, in the order of the bag.

    Parameters
    ----------
    logged : numpy.ndarray of int64, shape (n,)
        Log times [ns].
    header : numpy.ndarray of int64, shape (n,)
        Header stamps [ns]; 0 where there is none.

    """

    logged: IntArray
    header: IntArray


def common_clock(streams: Mapping[str, Stamps]) -> tuple[dict[str, IntArray], list[str]]:
    """
    Put all streams on one clock.

    Streams with header stamps keep them; zero and outlying ones are filled in from the log time.
    A stream whose header time runs back far, as after the reset of a simulator, or stands still
    counts as one without headers. One stamped stream is the reference, the wheels where they
    are, and a stream whose clock runs apart from it is shifted onto it. Streams without headers
    take the log time, shifted onto the reference's clock where that is another one. If the
    clocks of commands, wheels, imu and pose do not run at one rate (a replay at another speed),
    all take log times; any other stream by itself.

    Parameters
    ----------
    streams : mapping of str to Stamps
        By name; those of transforms are ``parent>child``.

    Returns
    -------
    times : dict of str to numpy.ndarray of int64
        Time of each message [ns], not sorted.
    notes : list of str
        What was repaired.

    Raises
    ------
    RecordingError
        If the times span more than 30 days.

    """
    notes: list[str] = []
    headers = _headers(streams, notes)
    delays = {name: header - streams[name].logged for name, header in headers.items()}
    aside = _unsteady(streams, delays)
    delays = {name: delay for name, delay in delays.items() if name not in aside}
    reference = min(delays, key=_trust, default='')
    gaps = {name: _gap(name, reference, streams, delays) for name in delays}
    drift = max((abs(_drift(name, gap)) for name, gap in gaps.items()), default=0)
    if any(name not in delays for name in streams if _is_main(name)):  # it has log times
        drift = max((drift, *(_wander(streams[name], delay)
                              for name, delay in delays.items() if _is_main(name))))
    if drift > SKEW_NS:
        notes.append(f'header clock and log clock drift apart by {drift * 1e-9:.1f} s: '
                     'log times used for all streams')
        times = {name: stamps.logged for name, stamps in streams.items()}
    else:
        notes += [f'{name}: header clock drifts by {apart * 1e-9:.1f} s: log times used instead'
                  for name, apart in aside.items()]
        times = {name: headers[name] + _shift(name, reference, gaps[name], notes)
                 if name in delays else
                 stamps.logged + _onto_headers(name, reference, streams, delays, notes)
                 for name, stamps in streams.items()}
    _check_span(times)
    return times, notes


def _is_main(name: str) -> bool:
    """Say whether a robot's motion is in a stream; voltage and currents only go with it."""
    return name in MAIN or '>' in name


def _unsteady(
    streams: Mapping[str, Stamps], delays: Mapping[str, IntArray],
) -> dict[str, int]:
    """
    Return the streams beside the main ones that drift, and by how much [ns].

    They are held against a main stream, or against log times where none of these is stamped.
    """
    anchor = min((name for name in delays if _is_main(name)), key=_trust, default='')
    if not anchor and len(delays) == len(streams):
        return {}
    drifts = {name: abs(_drift(name, _gap(name, anchor, streams, delays))) if anchor
              else _wander(streams[name], delays[name])
              for name in delays if not _is_main(name)}
    return {name: drift for name, drift in drifts.items() if drift > SKEW_NS}


def _headers(streams: Mapping[str, Stamps], notes: list[str]) -> dict[str, IntArray]:
    """Return the header stamps of the streams that have sensible ones, gaps filled in."""
    headers: dict[str, IntArray] = {}
    for name, stamps in streams.items():
        mended = _mended(name, stamps, notes)
        if mended is None:
            continue
        back = _step_back(stamps.logged, mended)
        if back:
            notes.append(f'{name}: header time goes backwards by {back * 1e-9:.1f} s: '
                         'log times used instead')
        else:
            headers[name] = mended
    return headers


def _step_back(logged: IntArray, header: IntArray) -> int:
    """
    Return the largest step back of the header time that lasts [ns], 0 without one.

    A few old messages that come late are none: the delay is as before after them.
    """
    if _frozen(logged):
        return 0
    delay, steps = header - logged, np.diff(header)
    far = [place for place in np.argsort(steps)[:NEIGHBOURS] if steps[place] < -OUTLIER_NS]
    return max((int(-steps[place]) for place in far
                if np.median(delay[:place + 1]) - np.median(delay[place + 1:]) > OUTLIER_NS),
               default=0)


def _trust(name: str) -> int:
    """Return the rank of a stream as reference: poses come late, commands from elsewhere."""
    ranks = {'wheels': 0, 'imu': 1, 'command': 3}
    return 4 if '>' in name else ranks.get(name, 2)


def _delay_at(logged: IntArray, stamps: Stamps, delay: IntArray) -> IntArray:
    """Return a stream's header time less log time when another was logged [ns]."""
    order = np.argsort(stamps.logged, kind='stable')
    start, usual = stamps.logged[order[0]], int(np.median(delay))
    # Relative to the start and the median: as they are, floats hold them to 0.3 µs only.
    apart = np.interp((logged - start).astype(np.float64),
                      (stamps.logged[order] - start).astype(np.float64),
                      (delay[order] - usual).astype(np.float64))
    result: IntArray = usual + np.rint(apart).astype(np.int64)
    return result


def _gap(name: str, reference: str, streams: Mapping[str, Stamps],
         delays: Mapping[str, IntArray]) -> IntArray:
    """
    Return how far a stream's header clock is ahead of the reference's [ns].

    One value a message while both were logged. Where log times do not tell (all alike, or
    nothing logged while the other was), one value, and 0 unless it is very large.
    """
    logged, base = streams[name].logged, streams[reference].logged
    both = (logged >= base.min()) & (logged <= base.max())
    if _frozen(logged) or _frozen(base) or not np.any(both):
        apart = int(np.median(delays[name])) - int(np.median(delays[reference]))
        return np.array([apart if abs(apart) > FOREIGN_NS else 0])
    gap: IntArray = delays[name][both] - _delay_at(
        logged[both], streams[reference], delays[reference])
    return gap


def _drift(name: str, gap: IntArray) -> int:
    """Return by how much a gap grows [ns]; 0 if the stream may just come late."""
    first, last = _ends(gap, max(1, gap.size // 4))
    late = _late(name, min(first, last)) and max(first, last) <= SKEW_NS
    return 0 if late else _growth(gap)


def _ends(values: IntArray, count: int) -> tuple[int, int]:
    return int(np.median(values[:count])), int(np.median(values[-count:]))


def _growth(values: IntArray) -> int:
    """
    Return by how much delays grow from their start to their end [ns].

    Two clocks that drift stay apart; where a link is congested for a while, messages are logged
    late, and in time again after it. So the quarters and the very ends both have to tell.
    """
    quarter = max(1, values.size // 4)
    ends = [_ends(values, count) for count in (quarter, min(quarter, NEIGHBOURS))]
    return min((last - first for first, last in ends), key=abs)


def _wander(stamps: Stamps, delay: IntArray) -> int:
    """Return by how much header and log clock drift apart [ns], 0 if log times do not tell."""
    return 0 if _frozen(stamps.logged) else abs(_growth(delay))


def _late(name: str, apart: int) -> bool:
    """Say whether a sensor's stamps may be so far behind just because it takes its time."""
    return name != 'command' and -FOREIGN_NS <= apart < -SKEW_NS


def _shift(name: str, reference: str, gap: IntArray, notes: list[str]) -> int:
    apart = int(np.median(gap))
    if abs(apart) <= SKEW_NS:
        return 0
    if _late(name, apart):
        notes.append(f'{name} is stamped {-apart * 1e-9:.3f} s earlier than {reference} logged '
                     'with it: delayed, or on another clock; left unchanged')
        return 0
    notes.append(f'{name} is on another clock: shifted by {-apart * 1e-9:.3f} s')
    return -apart


def _onto_headers(name: str, reference: str, streams: Mapping[str, Stamps],
                  delays: Mapping[str, IntArray], notes: list[str]) -> IntArray | int:
    """Return what puts log times on the reference's clock [ns], each where the clocks drift."""
    if not reference:
        return 0
    base, delay = streams[reference], delays[reference]
    if _wander(base, delay) > SKEW_NS:
        apart = _delay_at(streams[name].logged, base, delay)
        notes.append(f'{name} has no usable header stamps: log times shifted by '
                     f'{apart[0] * 1e-9:.3f} to {apart[-1] * 1e-9:.3f} s onto the header clock')
        return apart
    common = int(np.median(delay))
    if abs(common) <= SKEW_NS:
        return 0
    notes.append(f'{name} has no usable header stamps: log times shifted by '
                 f'{common * 1e-9:.3f} s onto the header clock')
    return common


def _frozen(logged: IntArray) -> bool:
    """Say whether a bag was converted without log times."""
    return logged.size > 1 and bool(np.all(logged == logged[0]))


def _mended(name: str, stamps: Stamps, notes: list[str]) -> IntArray | None:
    """Return complete header stamps, or None if most are missing."""
    there = stamps.header > 0
    if 2 * np.count_nonzero(there) <= there.size:
        return None
    header, logged = stamps.header.copy(), stamps.logged
    if np.ptp(header[there]) == 0 and np.ptp(logged) > SKEW_NS:
        notes.append(f'{name}: header stamps do not advance: log times used instead')
        return None
    delay = (header - logged)[there]
    usual = np.empty(header.size, dtype=np.int64)
    usual[there] = median_filter(delay, size=min(NEIGHBOURS, delay.size), mode='nearest')
    usual[~there] = int(np.median(delay))
    wrong = ~there if _frozen(logged) else ~there | (np.abs(header - logged - usual) > OUTLIER_NS)
    header[wrong] = (logged + usual)[wrong]
    if np.any(wrong):
        notes.append(f'{name}: {np.count_nonzero(wrong)} of {wrong.size} header stamps are zero '
                     'or inconsistent; log times used for them')
    return header


def _check_span(times: Mapping[str, IntArray]) -> None:
    filled = [stamps for stamps in times.values() if stamps.size]
    if not filled:
        return
    span = max(int(s.max()) for s in filled) - min(int(s.min()) for s in filled)
    if span > LONGEST_NS:
        raise RecordingError(
            f'stamps span {span / 86_400e9:.0f} days; at most {LONGEST_NS / 86_400e9:.0f} days '
            'make sense, so stamps are damaged')
