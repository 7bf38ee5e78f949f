# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""How far one bag is from another: the yardstick of the share of improvement reached."""

from __future__ import annotations

from collections.abc import Mapping
import math

from lg_husky_sim.proof.settings import settings
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

# What counts as one unit in each channel when channels are put together.
SCALES: Mapping[str, float] = {
    'wheel_rad_s': 0.1, 'yaw_rate_rad_s': 0.02, 'step_m': 0.02, 'turn_rad': 0.02}
_WINDOW = 1.0


def _on(times: Vector, table: Vector, column: int) -> Vector:
    return np.interp(times, table[:, 0], table[:, column])


def _rms(values: Vector) -> float:
    return float(np.sqrt(np.mean(values ** 2))) if values.size else math.nan


def increments(poses: Vector, times: Vector, window: float = _WINDOW) -> Vector:
    """
    Return how far the robot went in `window` seconds, seen from its own pose.

    Parameters
    ----------
    poses
        Columns time, x, y [m], heading [rad], shape (n, 4).
    times
        Starts of the windows [s], shape (m,).
    window
        How long each is [s].

    Returns
    -------
    numpy.ndarray
        Ahead, to the left [m] and turned [rad], shape (m, 3).

    """
    x, y, heading = (_on(times, poses, k) for k in (1, 2, 3))
    later = times + window
    dx = _on(later, poses, 1) - x
    dy = _on(later, poses, 2) - y
    return np.column_stack([np.cos(heading) * dx + np.sin(heading) * dy,
                            -np.sin(heading) * dx + np.cos(heading) * dy,
                            _on(later, poses, 3) - heading])


def errors(predicted: Mapping[str, Vector], measured: Mapping[str, Vector]) -> dict[str, float]:
    """
    Return root-mean-square errors by channel, and one number of all channels.

    Parameters
    ----------
    predicted, measured
        Two bags (`bags.read_bag`) of one drive.

    Returns
    -------
    dict
        'wheel_rad_s', 'yaw_rate_rad_s', 'step_m' and 'turn_rad' (motion within one second),
        'position_m' (the whole path), and 'all': the root mean square of the first four,
        each over its `SCALES` entry.

    """
    shift = 0.0
    start, end = measured['joints'][0, 0], measured['joints'][-1, 0]
    if predicted['joints'][-1, 0] < start or predicted['joints'][0, 0] > end:
        shift = float(start - predicted['joints'][0, 0])
    moved = {name: np.column_stack([table[:, 0] + shift, table[:, 1:]])
             for name, table in predicted.items()}
    joints, imu, poses = (measured[name] for name in ('joints', 'imu', 'poses'))
    wheel = np.concatenate([joints[:, k] - _on(joints[:, 0], moved['joints'], k)
                            for k in (1, 2)])
    result = {'wheel_rad_s': _rms(wheel),
              'yaw_rate_rad_s': _rms(imu[:, 1] - _on(imu[:, 0], moved['imu'], 1))}
    starts = np.arange(poses[0, 0], poses[-1, 0] - _WINDOW, 0.1)
    gap = increments(poses, starts) - increments(moved['poses'], starts)
    result['step_m'] = _rms(gap[:, :2].ravel())
    result['turn_rad'] = _rms(gap[:, 2])
    result['all'] = math.sqrt(sum((result[name] / scale) ** 2
                                  for name, scale in SCALES.items()) / len(SCALES))
    result['position_m'] = math.sqrt(sum(
        _rms(poses[:, k] - _on(poses[:, 0], moved['poses'], k)) ** 2 for k in (1, 2)))
    return result


def share(plain: float, augmented: float, truth: float, least: float = 0.1) -> float | None:
    """
    Return the share of the achievable improvement that was reached.

    Returns
    -------
    float or None
        (plain - augmented) / (plain - truth): 1 is as good as knowing the hidden robot,
        below 0 is worse than the plain model, and a model that runs away is -1. None where less
        than `least` of the plain error could be gained, so that there is nothing to reach.

    """
    achievable = plain - truth
    if not math.isfinite(achievable) or achievable < least * plain:
        return None
    return (plain - augmented) / achievable if math.isfinite(augmented) else -1.0


def wilson(hits: float, count: int) -> tuple[float, float]:
    """
    Return Wilson's 95 % interval of a proportion (E. B. Wilson, J. Am. Stat. Assoc. 22, 1927).

    Parameters
    ----------
    hits, count
        Successes among trials; no trial gives (0, 1).

    """
    if count == 0:
        return 0.0, 1.0
    z = float(settings()['intervals']['normal_quantile']['value'])
    p = hits / count
    centre = (p + z * z / (2 * count)) / (1 + z * z / count)
    half = z / (1 + z * z / count) * math.sqrt(p * (1 - p) / count + z * z / (4 * count ** 2))
    return max(0.0, centre - half), min(1.0, centre + half)
