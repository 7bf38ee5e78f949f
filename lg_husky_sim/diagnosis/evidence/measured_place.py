# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Where a drive is beyond a place, by its measured pose.

A simulation without corrections is metres beside the robot in the end, and would meet what begins
at a place at other times. So an effect of a place acts when the robot was there.
"""

from __future__ import annotations

from lg_husky_sim.diagnosis.evidence.drives import Channel, Drive
from lg_husky_sim.husky.effects import Onset, OnsetKind
from lg_husky_sim.husky.plant import acts
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray


def is_measured(drive: Drive, onset: Onset | None) -> bool:
    """Return whether a drive tells when an onset acts better than a simulation of it."""
    return (onset is not None and onset.kind is not OnsetKind.TIME
            and drive.pose_times.size > 1)


def acts_at(drive: Drive, onset: Onset, times: FloatArray, delay: float
            ) -> NDArray[np.bool_]:
    """
    Return when the effects of a place act.

    Parameters
    ----------
    drive : Drive
        With a pose.
    onset : Onset
        Of a place.
    times : numpy.ndarray, shape (n,)
        [s]
    delay : float
        How late the stamps of the pose are [s].

    Returns
    -------
    numpy.ndarray of bool, shape (n,)

    """
    return acts(onset, times, measured_x(drive, times, delay))


def measured_x(drive: Drive, times: FloatArray, delay: float) -> FloatArray:
    """Return where a drive with a pose was at times [s], its stamps so late [s]."""
    x = drive.measured[drive.slice_of(Channel.X)]
    return np.asarray(np.interp(times, drive.pose_times - delay, x), dtype=np.float64)


def legs_of(drive: Drive, onset: Onset, delay: float) -> list[tuple[float, bool]]:
    """
    Return until when effects of a place act, and when not, by turns.

    Parameters
    ----------
    drive, onset, delay
        As of :func:`acts_at`.

    Returns
    -------
    list of (float, bool)
        End of each leg [s], the last one without end, and whether they act in it.

    """
    times = drive.pose_times - delay
    x = drive.measured[drive.slice_of(Channel.X)]
    on = acts(onset, times, x)
    before = np.flatnonzero(on[1:] != on[:-1])
    part = (onset.value - x[before]) / (x[before + 1] - x[before])
    crossed = times[before] + part * (times[before + 1] - times[before])
    inside = crossed > drive.start
    first = bool(on[before[inside][0]]) if np.any(inside) else bool(on[-1])
    ends = [*crossed[inside].tolist(), float('inf')]
    return [(end, first != bool(k % 2)) for k, end in enumerate(ends)]
