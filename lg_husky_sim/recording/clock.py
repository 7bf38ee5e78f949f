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

NEIGHBOURS = 11
"""Messages that a header stamp is held against."""
OUTLIER_NS = 1_000_000_000
"""A header this far from its neighbours' delay is wrong."""
SKEW_NS = 500_000_000
"""Two clocks this far apart are different clocks."""
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
    A stream whose clock runs apart from the others' is shifted onto theirs. Streams without
    headers take the log time, shifted onto the headers' clock where that is another one. If the
    two clocks do not run at one rate (a replay at another speed), all take log times.

    Parameters
    ----------
    streams : mapping of str to Stamps

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
    headers: dict[str, IntArray] = {}
    for name, stamps in streams.items():
        mended = _mended(name, stamps, notes)
        if mended is not None:
            headers[name] = mended
    delays = {name: header - streams[name].logged for name, header in headers.items()}
    times: dict[str, IntArray] = {}
    unstamped = [name for name in streams if name not in delays]
    middle = {name: int(np.median(delay)) for name, delay in delays.items()}
    common = int(np.median(list(middle.values()))) if middle else 0
    drift = max((int(np.ptp(np.quantile(delay, (0.05, 0.95)))) for delay in delays.values()),
                default=0)
    if unstamped and drift > SKEW_NS:
        notes.append(f'header clock and log clock drift by {drift * 1e-9:.1f} s: '
                     'log times taken throughout')
        times = {name: stamps.logged for name, stamps in streams.items()}
    else:
        for name, stamps in streams.items():
            if name not in headers:
                shift = common if abs(common) > SKEW_NS else 0
                if shift:
                    notes.append(f'{name} has no header stamps: log times shifted by '
                                 f'{shift * 1e-9:.3f} s onto the header clock')
                times[name] = stamps.logged + shift
            elif abs(middle[name] - common) > 10 * SKEW_NS:
                shift = common - middle[name]
                notes.append(f'{name} runs on a clock of its own: shifted by '
                             f'{shift * 1e-9:.3f} s')
                times[name] = headers[name] + shift
            else:
                times[name] = headers[name]
    _check_span(times)
    return times, notes


def _mended(name: str, stamps: Stamps, notes: list[str]) -> IntArray | None:
    """Return complete header stamps, or None if most are missing."""
    there = stamps.header > 0
    if 2 * np.count_nonzero(there) <= there.size:
        return None
    header, logged = stamps.header.copy(), stamps.logged
    delay = (header - logged)[there]
    usual = np.empty(header.size, dtype=np.int64)
    usual[there] = median_filter(delay, size=min(NEIGHBOURS, delay.size), mode='nearest')
    usual[~there] = int(np.median(delay))
    frozen = logged.size > 1 and bool(np.all(logged == logged[0]))  # converted without log times
    wrong = ~there if frozen else ~there | (np.abs(header - logged - usual) > OUTLIER_NS)
    header[wrong] = (logged + usual)[wrong]
    if np.any(wrong):
        notes.append(f'{name}: {np.count_nonzero(wrong)} of {wrong.size} header stamps are zero '
                     'or out of line; log times taken for them')
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
