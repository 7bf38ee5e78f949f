# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Dynamics without a name respond to the past motion; noise, of whatever spectrum, does not."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from lg_husky_sim.diagnosis.conclusion import answer
from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, evidence_of, Fit
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.observation import probe_times
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.evidence.whitener import respond
from lg_husky_sim.diagnosis.hypotheses.past_motion import PAST, responses
from lg_husky_sim.diagnosis.hypotheses.smooth_efforts import efforts
from lg_husky_sim.diagnosis.localisation import missing_efforts
from lg_husky_sim.diagnosis.nameless import needed_evidence, unknown_finding
from lg_husky_sim.diagnosis.result import Verdict
from lg_husky_sim.diagnosis.selection.rounds import Round
from lg_husky_sim.diagnosis.selection.screening import Projection
from lg_husky_sim.diagnosis.selection.search import Search
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.threads import Threads
import numpy as np
import pytest

MOMENT = 1


@pytest.fixture(scope='module')
def fitted(drive: Callable[..., Recording]) -> Iterator[tuple[Evidence, Fit]]:
    """Return the evidence of one drive of a robot that lacks nothing, and its fit."""
    drives, model = drives_of([drive('ahead', 'nothing', 1)]), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['ahead'], start, first_guess(drives), pool)
        yield evidence, evidence.fit(start)


def _left_by(evidence: Evidence, fit: Fit, moment: FloatArray) -> Search:
    # A search that found nothing where a moment at the probe times acts beside white noise, as
    # far as the numbers of the base cannot do the same.
    whitener, drive = evidence.whiteners[0], evidence.drives[0]
    frame, times = whitener.frame, probe_times(drive)
    pushed = np.zeros((times.size, 4, 1))
    pushed[:, MOMENT, 0] = moment
    out = np.empty((frame.times.size, 1))
    respond(pushed, times, frame.times, drive.channels, frame.order, frame.cosine, frame.sine,
            whitener.model, setting('longest_step'), out)
    noise = np.random.default_rng(5).standard_normal(evidence.count)
    left = replace(fit, whitened=noise + Projection(fit).apart(whitener.apply(out))[:, 0])
    return Search(left, left, evidence, (Round(evidence, left, (), False, 1.0),), ())


def test_a_moment_that_lags_behind_the_turning_is_unknown_and_says_what_it_follows(
        fitted: tuple[Evidence, Fit]) -> None:
    evidence, fit = fitted
    yaw = evidence.motions(fit.point, True)[0].column('yaw_rate', 'probe')
    late = np.concatenate([np.zeros(25), yaw[:-25]])
    search = _left_by(evidence, fit, -4.0 * late)
    rest = efforts(evidence, search.final)
    assert rest[0].balance == 'moment'
    assert rest[0].argument in ('past_yaw', 'past_turn')
    assert rest[0].largest == pytest.approx(4.0 * float(np.max(np.abs(yaw))), rel=0.4)
    free = missing_efforts(evidence, search.final)
    assert answer(search, rest, free).verdict is Verdict.UNKNOWN
    said = unknown_finding(search, rest, free)
    assert f'that follows {PAST[rest[0].argument][2]}' in said.statement
    assert said.regime == rest[0].argument.replace('_', ' ')


def test_a_moment_that_swings_on_its_own_is_noise_whatever_its_spectrum(
        fitted: tuple[Evidence, Fit]) -> None:
    """A floor of waves is no first-order noise, yet nothing about the robot is missing."""
    evidence, fit = fitted
    times = probe_times(evidence.drives[0])
    search = _left_by(evidence, fit, 0.8 * np.sin(2.0 * np.pi * 0.37 * times))
    rest, free = efforts(evidence, search.final), missing_efforts(evidence, search.final)
    assert max(m.evidence for m in free) > needed_evidence(rest, free)
    assert answer(search, rest, free).verdict is Verdict.NOTHING_MISSING


def test_a_response_to_the_past_is_its_kernel_over_the_lags() -> None:
    times = np.arange(0.0, 8.0, 0.02)
    pulse = np.where((times >= 2.0) & (times < 2.02), 1.0, 0.0)
    found = responses(pulse, times, 'past_yaw', 9)
    assert found.shape == (times.size, 9)
    assert np.sum(found[times < 1.99]) == 0.0
    # Hats add up to one at every lag until the longest.
    inside = (times > 1.99) & (times < 2.0 + setting('longest_past') - 0.05)
    assert np.allclose(np.sum(found[inside], axis=1), 0.02)
    assert np.allclose(found[times > 2.05 + setting('longest_past')], 0.0)
    # Knots are dense at first: half of what a pulse does by the first ones is soon over.
    spread = [float(np.sum(found[:, k] > 1e-12)) for k in range(9)]
    assert spread == sorted(spread[:-1]) + spread[-1:]
    # A constant signal was there before the first time, and of a sign its size does not count.
    level = responses(np.full(times.size, 0.7), times, 'past_yaw', 9)
    assert np.allclose(level, level[0])
    turn = responses(np.full(times.size, 0.7), times, 'past_turn', 9)
    assert np.allclose(turn, level / 0.7)
