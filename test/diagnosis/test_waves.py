# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A ground with waves, which a robot drives over at any heading."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from lg_husky_sim.diagnosis.conclusion import answer
from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, evidence_of, Fit
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.hypotheses.smooth_efforts import BALANCES, moved_by
from lg_husky_sim.diagnosis.hypotheses.waves import pushed, spectrum, wave_numbers, waves
from lg_husky_sim.diagnosis.localisation import missing_efforts
from lg_husky_sim.diagnosis.nameless import left_over, unknown_finding
from lg_husky_sim.diagnosis.result import Verdict
from lg_husky_sim.diagnosis.selection.rounds import Round
from lg_husky_sim.diagnosis.selection.screening import Projection
from lg_husky_sim.diagnosis.selection.search import Search
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.threads import Threads
import numpy as np
import pytest

#: A hall of about 5 m by 5 m, at all headings.
WAYS = [(1.2, 0.6 + 0.2 * float(np.sin(2.1 * k)), 0.25 + 0.6 * float(np.sin(1.9 * k)))
        for k in range(60)]


@pytest.fixture(scope='module')
def roamed(record: Callable[..., Recording]) -> Iterator[tuple[Evidence, Fit]]:
    """Return the evidence of a drive of a robot that lacks nothing, and its fit."""
    model = load_model()
    recording = record('hall', compile_model(model.structure).at(model.parameters), WAYS, 7)
    drives = drives_of([recording])
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        evidence = evidence_of(drives, [recording.name], start, first_guess(drives), pool)
        yield evidence, evidence.fit(start)


@pytest.mark.parametrize(('length', 'way'), [(0.8, 0.0), (1.4, 2.2), (1.1, 0.9)])
def test_waves_of_the_ground_are_unknown_and_say_how_long_they_are(
        roamed: tuple[Evidence, Fit], length: float, way: float) -> None:
    """Over the distance driven they have no period, and nothing was missing."""
    evidence, fit = roamed
    (whitener,), (motion,) = evidence.whiteners, evidence.motions(fit.point, True)
    x, y, heading = (motion.column(name, 'probe') for name in ('x', 'y', 'heading'))
    slope = 8.0 * np.cos(heading - way) * np.sin(
        2.0 * np.pi / length * (x * np.cos(way) + y * np.sin(way)) + 0.7)
    moved = whitener.apply(moved_by(whitener, BALANCES['force'][0], slope[:, None]))
    noise = np.random.default_rng(5).standard_normal(evidence.count)
    left = replace(fit, whitened=noise + Projection(fit).apart(moved)[:, 0])
    (found,) = waves(evidence, left)
    # Half a period more or less over the hall.
    assert abs(1.0 / found.period - 1.0 / length) < 0.07
    assert abs(np.sin(found.way - way)) < 0.15
    assert 4.0 < found.largest < 12.0
    search = Search(left, left, evidence, (Round(evidence, left, (), False, 1.0),), ())
    rest, free = left_over(evidence, left), missing_efforts(evidence, left)
    assert answer(search, rest, free).verdict is Verdict.UNKNOWN
    said = unknown_finding(search, rest, free)
    assert said.subsystem == 'translation'
    assert 'a force on the chassis of waves of the ground' in said.statement


def test_noise_has_waves_no_more_often_than_its_evidence_says(
        roamed: tuple[Evidence, Fit]) -> None:
    evidence, fit = roamed
    seen = []
    for seed in range(12):
        noise = np.random.default_rng(seed).standard_normal(evidence.count)
        seen += [one.evidence for one in waves(evidence, replace(fit, whitened=noise))]
    assert sum(one > np.log(1.0 / 0.05) for one in seen) <= 3


def test_waves_are_looked_for_once_and_the_longer_ones_where_there_are_too_many() -> None:
    every = wave_numbers(6.0, 0.5, 10000)
    size = np.hypot(*every.T)
    assert np.min(size) >= 1.0 / 6.0
    assert 1.9 < np.max(size) <= 2.0
    # No wave and its opposite.
    distances = np.hypot(*(every[:, None] + every[None]).reshape(-1, 2).T)
    assert np.min(distances) > 0.05
    few = wave_numbers(6.0, 0.5, 200)
    assert 150 < len(few) <= 200
    assert np.max(np.hypot(*few.T)) < 1.5


def test_waves_of_a_grid_are_pushed_by_as_much_as_one_by_one() -> None:
    random = np.random.default_rng(3)
    place, heading = random.uniform(-3.0, 3.0, (40, 2)), random.uniform(-4.0, 4.0, 40)
    push = random.standard_normal(40)
    tried = wave_numbers(6.0, 0.5, 10000)
    assert np.allclose(spectrum(tried, push, place, heading),
                       push @ pushed(tried, place, heading), rtol=0.0, atol=1e-9)
