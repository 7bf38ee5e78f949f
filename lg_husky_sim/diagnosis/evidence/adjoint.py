# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The score of an effort at every moment and every balance, in one pass backwards.

The innovations of what an effort u does are linear in it, ``e = C u``, by the deviation model and
the filter (:mod:`.whitener`): with the difference z of what it moves and what the filter follows::

    z <- A z + B u,   e_k = (H z + D u) / s_k,   z <- z - K_k (H z + D u)

The products ``C' w`` with given weights w of the innovations then come, for all moments at once,
from the adjoint recursion, in which every step is transposed and time runs backwards, at the cost
of one column.
"""

from __future__ import annotations

from lg_husky_sim.diagnosis.evidence.noise import Whitener
from lg_husky_sim.diagnosis.evidence.observation import probe_times
from lg_husky_sim.diagnosis.evidence.whitener import Integers, state_of
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.jit import jit
from lg_husky_sim.signals import FloatArray
import numpy as np


def scores(whitener: Whitener, weights: FloatArray) -> FloatArray:
    """
    Return the product of the innovations of efforts with weights of the innovations.

    Parameters
    ----------
    whitener : Whitener
        Of a drive.
    weights : numpy.ndarray, shape (n,)
        In the order of time.

    Returns
    -------
    numpy.ndarray, shape (n_probe, 4)
        For a force [1/N], a moment and a torque on the left and right wheels [1/(N·m)] from each
        probe time of the drive to the next.

    """
    frame = whitener.frame
    grid = probe_times(frame.drive)
    out = np.zeros((grid.size, 4))
    _scores(np.ascontiguousarray(weights), grid, frame.times, frame.drive.channels, frame.order,
            frame.cosine, frame.sine, whitener.model, whitener.process, setting('longest_step'),
            whitener.gain, whitener.scale, out)
    return out


@jit
def _scores(weights: FloatArray, grid: FloatArray, times: FloatArray, channels: Integers,
            order: Integers, cosine: FloatArray, sine: FloatArray, m: FloatArray,
            process: FloatArray, longest: float, gain: FloatArray, scale: FloatArray,
            out: FloatArray) -> None:
    # The transposes of respond() and whiten(), step by step and in reverse.
    back = np.zeros(12)
    spacing, last = grid[1] - grid[0], grid.size - 1
    for k in range(order.size - 1, -1, -1):
        reading = order[k]
        now = times[reading]
        channel = int(channels[reading])
        seen = weights[k] / scale[k]
        for i in range(12):
            seen -= gain[k, i] * back[i]
        if channel < 2:
            at = max(0, min(last, int((now - grid[0]) / spacing)))
            by = 12 + 4 * channel
            back[4] += m[by] * seen
            back[5] += m[by + 1] * seen
            for side in range(2):
                back[2 + side] += m[by + 2 + side] * seen
                out[at, 2 + side] += m[by + 2 + side] * seen
        elif channel == 2:
            back[5] += seen
            back[6] += seen
        else:
            back[state_of(channel)] += seen
        before = times[order[k - 1]] if k > 0 else now
        # The last of the steps forwards, which begin at sums of the longest one, is the short one.
        count, left = 0, now - before
        while left > 1e-9:
            left -= min(left, longest)
            count += 1
        for number in range(count - 1, -1, -1):
            moment, left = before, now - before
            for _ in range(number):
                moment += longest
                left -= longest
            dt = min(left, longest)
            at = max(0, min(last, int((moment - grid[0]) / spacing)))
            v, w = back[4], back[5]
            pushed = (dt * (m[4] * v + m[8] * w), dt * (m[5] * v + m[9] * w),
                      dt * (m[6] * v + m[10] * w + m[14] * back[10] + m[18] * back[11]),
                      dt * (m[7] * v + m[11] * w + m[15] * back[10] + m[19] * back[11]))
            for i in range(4):
                back[i] = np.exp(-dt / process[min(3 + i, 5)]) * back[i] + pushed[i]
                out[at, i] += pushed[i]
            back[4] = v + dt * (m[0] * v + m[2] * w + cosine[reading] * back[8]
                                + sine[reading] * back[9] + m[12] * back[10] + m[16] * back[11])
            back[5] = w + dt * (m[1] * v + m[3] * w + back[7] + m[13] * back[10]
                                + m[17] * back[11])
