# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Stamps that jitter are told from readings at uneven times."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import re

from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, evidence_of
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.stamps import evened, likeliest_stamps
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.log_notes import log_notes
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.threads import Threads
import numpy as np
import pytest

RNG = np.random.default_rng


@pytest.mark.parametrize(('period', 'jitter', 'drift'), [
    (0.05, 0.004, 0.0), (0.05, 0.001, 3e-5), (0.02, 0.002, -3e-5), (0.1, 0.012, 1e-4)])
def test_even_times_are_found_through_jitter_drift_and_lost_messages(
        period: float, jitter: float, drift: float) -> None:
    rng = RNG(3)
    true = 5.0 + period * (1.0 + drift) * np.arange(int(60.0 / period))
    stamps = true + rng.normal(0.0, jitter, true.size)
    kept = rng.random(true.size) > 0.01
    found = evened(stamps[kept])
    assert np.std(found - true[kept]) < 0.25 * jitter


@pytest.mark.parametrize('stamps', [
    np.cumsum(RNG(1).exponential(0.02, 500)), np.array([0.0, 0.02, 0.04]),
    0.02 * np.arange(500) + RNG(2).normal(0.0, 0.008, 500)])
def test_stamps_that_tell_no_even_series_stay(stamps: FloatArray) -> None:
    stamps = np.sort(stamps)
    assert evened(stamps) is stamps


def evidence_with(recording: Recording, pool: Threads) -> tuple[Evidence, Evidence]:
    """Return the evidence of a recording at nominal numbers, with logged and likeliest stamps."""
    drives, model = drives_of([recording]), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    evidence = evidence_of(drives, [recording.name], start, first_guess(drives), pool)
    fit = evidence.fit(start, rounds=1)
    best, point = likeliest_stamps(evidence, fit)
    assert best.surprise_at(point) <= evidence.surprise(fit)
    return evidence, best


def test_the_likelihood_says_whether_stamps_or_readings_are_uneven(
        drive: Callable[..., Recording]) -> None:
    recording = drive('ahead', 'nothing', 1)
    wheels = recording.streams['wheels']
    every = wheels.times[::2] if len(wheels) < 600 else wheels.times[::5]
    even = TimeSeries(every, np.column_stack([
        np.interp(every, wheels.times, column) for column in wheels.values.T]), wheels.names)
    off = 0.2 * float(np.median(np.diff(every))) * RNG(5).uniform(-1.0, 1.0, every.size)
    stamped = replace(even, times=every + off)
    moved = np.clip(every + off, wheels.times[0], wheels.times[-1])
    sampled = TimeSeries(moved, np.column_stack([
        np.interp(moved, wheels.times, column) for column in wheels.values.T]), wheels.names)
    with Threads(1) as pool:
        for series, is_even in ((stamped, True), (sampled, False)):
            logged, best = evidence_with(replace(recording, streams={
                **recording.streams, 'wheels': series}), pool)
            stamps, found = (one.drives[0].wheel_times for one in (logged, best))
            assert (np.std(np.diff(found)) < 0.3 * np.std(np.diff(stamps))) == is_even
            said = re.findall(r'stamps of the wheels jitter by ([\d.]+) ms',
                              ' '.join(log_notes(best.drives)))
            assert [float(jitter) for jitter in said] == (
                [pytest.approx(1e3 * np.std(off), rel=0.1)] if is_even else [])
