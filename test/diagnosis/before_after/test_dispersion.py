# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Channels count by as much as their residuals tell of the parameters."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from lg_husky_sim.diagnosis.before_after.base import Base, base_of
from lg_husky_sim.diagnosis.before_after.dispersion import dispersed
from lg_husky_sim.diagnosis.before_after.drives import Drive, drives
from lg_husky_sim.diagnosis.before_after.fitting import Prior
from lg_husky_sim.diagnosis.before_after.prediction import CHANNELS, KINDS, residual
from lg_husky_sim.diagnosis.before_after.settings import settings
from lg_husky_sim.diagnosis.before_after.whitening import Noise
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np
import pytest

KNOWN = settings()
SECONDS = 90.0
Adds = Callable[[str, FloatArray], FloatArray]


def base() -> Base:
    """Return the base as it begins."""
    return base_of(KNOWN, load_model().parameters, False)


def drive(of: Base, seed: int, adds: Adds) -> Drive:
    """Return a drive that the base predicts but for white noise and what is added to a channel."""
    rng = np.random.default_rng(seed)
    times = np.arange(0.0, SECONDS, 0.05)
    held = np.repeat(rng.uniform(-0.8, 0.8, (times.size // 30, 2)), 30, axis=0)

    def silent(hertz: float, *names: str) -> TimeSeries:
        at = np.arange(0.0, SECONDS, 1.0 / hertz)
        return TimeSeries(at, np.zeros((at.size, len(names))), names)
    streams = {'command': TimeSeries(times, held, ('forward', 'yaw')),
               'wheels': silent(50.0, 'left', 'right'),
               'imu': silent(100.0, 'yaw_rate', 'accel_x', 'accel_y')}
    (one,) = drives(Recording(f'rec{seed}', f'rec{seed}', streams, 0), KNOWN.simulation['step'],
                    KNOWN.bins, 0.5, 3.0)
    bins = {}
    for stream, off in residual(of, one, of.start).items():
        there = one.bins[stream]
        errors = np.column_stack([
            KNOWN.noise[KINDS[name]] * (rng.standard_normal(len(off))
                                        + adds(name, there.centres()))
            for name in CHANNELS[stream]])
        bins[stream] = replace(there, values=there.values - off + errors)
    return replace(one, bins=bins)


def factors(adds: Adds) -> dict[str, float]:
    """Return by how much each channel's noise is widened."""
    of = base()
    groups = {f'rec{k}': [drive(of, k, adds)] for k in range(3)}
    free = np.array([q.name not in KNOWN.runs_as for q in KNOWN.quantities])
    white = Noise(dict.fromkeys(KINDS, np.ones(1)), {
        name: KNOWN.noise[KINDS[name]] for name in ('left', 'right', 'yaw', 'accel_x', 'accel_y')})
    with ThreadPoolExecutor(2) as pool:
        found = dispersed(of, groups, dict.fromkeys(groups, of.start), white,
                          Prior(of.start, of.sd, free), pool)
    return {name: size / white.sd[name] for name, size in found.sd.items()}


def test_white_residuals_tell_as_much_as_they_promise() -> None:
    assert factors(lambda name, times: np.zeros(times.size)) == pytest.approx(
        dict.fromkeys(('left', 'right', 'yaw', 'accel_x', 'accel_y'), 1.0), abs=0.25)


def test_what_lasts_for_seconds_tells_less_and_only_in_its_channel() -> None:
    slow = factors(lambda name, times: (
        np.sin(2.0 * np.pi * times / 9.0) if name == 'yaw' else np.zeros(times.size)))
    assert slow.pop('yaw') > 1.7
    assert slow == pytest.approx(dict.fromkeys(('left', 'right', 'accel_x', 'accel_y'), 1.0),
                                 abs=0.25)


def test_a_recording_of_one_block_says_nothing_of_it() -> None:
    of = base()
    one = drive(of, 1, lambda name, times: np.zeros(times.size))
    long = {**KNOWN.fit, 'block': 10.0 * SECONDS}
    of = replace(of, settings=replace(KNOWN, fit=long))
    white = Noise(dict.fromkeys(KINDS, np.ones(1)), {'left': 0.01, 'yaw': 0.01})
    with ThreadPoolExecutor(1) as pool:
        found = dispersed(of, {'rec1': [one]}, {'rec1': of.start}, white, Prior(
            of.start, of.sd, np.ones(of.sd.size, dtype=np.bool_)), pool)
    assert found.sd == white.sd
