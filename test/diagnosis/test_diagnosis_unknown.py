# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Physics without a name: smooth efforts and bursts, and what only looks like them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from lg_husky_sim.diagnosis.conclusion import answer
from lg_husky_sim.diagnosis.decision.adoption import evidence_beyond_chance
from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, evidence_of, Fit
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.hypotheses.bursts import burst_evidence, levelled
from lg_husky_sim.diagnosis.hypotheses.hypothesis import Hypothesis
from lg_husky_sim.diagnosis.hypotheses.smooth_efforts import beyond_chance, Effort
from lg_husky_sim.diagnosis.localisation import steady_knots
from lg_husky_sim.diagnosis.result import Verdict
from lg_husky_sim.diagnosis.selection.rounds import Round
from lg_husky_sim.diagnosis.selection.screening import Projection
from lg_husky_sim.diagnosis.selection.search import Search
from lg_husky_sim.diagnosis.selection.tried import Tried
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.threads import Threads
import numpy as np
import pytest


@pytest.fixture(scope='module')
def fitted(drive: Callable[..., Recording]) -> Iterator[tuple[Evidence, Fit]]:
    """Return the evidence of one drive of a robot that lacks nothing, and its fit."""
    drives, model = drives_of([drive('ahead', 'nothing', 1)]), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['ahead'], start, first_guess(drives), pool)
        yield evidence, evidence.fit(start)


def _with(fit: Fit, innovations: FloatArray) -> tuple[Fit, Projection]:
    other = replace(fit, whitened=innovations)
    return other, Projection(other)


def test_an_effort_in_white_innovations_counts_for_all_that_it_explains(
        fitted: tuple[Evidence, Fit]) -> None:
    evidence, fit = fitted
    rng = np.random.default_rng(3)
    column = np.cos(np.linspace(0.0, 300.0, evidence.count))[:, None]
    noise = rng.standard_normal(evidence.count)
    other, projection = _with(fit, noise + 0.3 * column[:, 0])
    gain, explained, values, deviations = beyond_chance(evidence, other, projection, column)
    assert explained > 20.0
    assert gain > 0.6 * explained
    assert abs(values[0] - 0.3) < 4.0 * deviations[0]


def test_an_effort_in_slow_innovations_counts_for_less(fitted: tuple[Evidence, Fit]) -> None:
    """Noise that keeps its sign for a while looks like an effort that is slow as well."""
    evidence, fit = fitted
    times = evidence.whiteners[0].frame.times[evidence.whiteners[0].frame.order]
    # Noise of one value for half a second each, across an effort of that speed.
    part = ((times - times[0]) / 0.5).astype(np.int64)
    chances = np.zeros((2, 20))
    for seed in range(20):
        rng = np.random.default_rng(seed)
        column = rng.standard_normal(int(part[-1]) + 1)[part][:, None]
        noise = rng.standard_normal(int(part[-1]) + 1)[part]
        other, projection = _with(fit, noise)
        chances[:, seed] = beyond_chance(evidence, other, projection, column)[:2]
    most = evidence_beyond_chance(30)
    assert np.count_nonzero(chances[1] > most) >= 5
    assert np.count_nonzero(chances[0] > most) == 0


def test_an_effort_too_small_to_count_is_not_missing(fitted: tuple[Evidence, Fit]) -> None:
    """Whatever its evidence: a third of a newton moves no robot that anybody asks about."""
    evidence, fit = fitted
    search = Search(fit, fit, evidence, (Round(evidence, fit, (), False, 1.0),), ())

    def said(size: float) -> Verdict:
        effort = Effort('force', 'x', 60.0, 60.0, np.linspace(-size, size, 9),
                        np.full(9, 0.01), size)
        return answer(search, [effort], []).verdict
    assert said(0.37) is Verdict.NOTHING_MISSING
    assert said(7.0) is Verdict.UNKNOWN


def test_a_name_is_not_said_beside_a_larger_effort_without_one(
        fitted: tuple[Evidence, Fit]) -> None:
    """1226 nats for a name and 2965 for a smooth effort beside it are no answer."""
    evidence, fit = fitted
    slope = Hypothesis(Effect('slope'), ({'slope_x': 20.0, 'slope_y': 5.0},))
    slopes = evidence.fit(slope.point(fit.point, slope.starts[0]), rounds=1)
    tried = Tried(slope, slopes, 1226.0, evidence.count)
    search = Search(fit, fit, evidence, (Round(evidence, fit, (tried,), True, 1e-9),), (slope,))

    def said(explained: float) -> tuple[Verdict, float]:
        effort = Effort('moment', 'yaw', explained, explained, np.linspace(-9.0, 9.0, 9),
                        np.full(9, 0.01), 9.0)
        found = answer(search, [effort], [])
        return found.verdict, found.sure
    assert said(2965.0)[0] is Verdict.UNKNOWN
    assert said(300.0)[0] is Verdict.UNKNOWN
    assert said(20.0)[0] is said(100.0)[0] is Verdict.KNOWN
    assert said(100.0)[1] < said(20.0)[1]  # and less surely, the more it explains


def test_bursts_are_looked_for_where_the_drive_is_steady(fitted: tuple[Evidence, Fit]) -> None:
    """A late command leaves a burst, and so does a start in motion."""
    drive = fitted[0].drives[0]
    count = 40
    steady = steady_knots(drive, count)
    knots = np.linspace(drive.start, drive.end, count)
    spacing = knots[1] - knots[0]
    assert not np.any(steady[:2])
    assert np.any(steady)
    steps = np.abs(np.diff(drive.logged.values, axis=0))
    moments = drive.logged.times[1:][np.any(steps > setting('still_speed'), axis=1)]
    assert moments.size
    for moment in moments:
        assert not np.any(steady[np.abs(knots - moment) <= spacing])
    held = replace(drive, logged=replace(
        drive.logged, values=np.zeros_like(drive.logged.values)))
    assert np.array_equal(steady_knots(held, count), np.arange(count) > 1)


def test_a_floor_that_is_rough_at_speed_is_no_burst_and_gusts_are_some() -> None:
    rng = np.random.default_rng(8)
    speeds = np.repeat([0.0, 0.3, 0.9], 50)
    floor = rng.standard_normal(150) * np.repeat([0.1, 0.6, 2.0], 50)
    gusts = rng.standard_normal(150) * np.where(rng.random(150) < 0.15, 8.0, 1.0)
    assert burst_evidence(floor) > evidence_beyond_chance(30)
    assert burst_evidence(levelled(floor, speeds)) < 0.0
    assert burst_evidence(levelled(gusts, speeds)) > evidence_beyond_chance(30)
    assert np.mean(levelled(floor, speeds) ** 2) == pytest.approx(1.0)
