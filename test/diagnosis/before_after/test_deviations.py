# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""By what recordings of one robot differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from lg_husky_sim.diagnosis.before_after.evidence import Evidence, Quadratic
from lg_husky_sim.diagnosis.before_after.settings import settings
from lg_husky_sim.signals import FloatArray
import numpy as np
import pytest


def recording(k: int, place: Sequence[float], curvature: FloatArray, after: bool) -> Quadratic:
    """Return the likelihood of a recording that is likeliest at a place."""
    at = np.array(place, dtype=float)
    return Quadratic(f'rec{k}', after, at, curvature, curvature @ at)


def test_what_recordings_differ_by_is_estimated() -> None:
    """From three recordings a set, around the means of the sets."""
    rng = np.random.default_rng(2)
    places = rng.standard_normal(6)
    places = 0.005 * (places - np.repeat([places[:3].mean(), places[3:].mean()], 3))
    places[3:] += 0.05
    precise = np.array([[1e8]])
    recordings = [recording(k, [places[k]], precise, k > 2) for k in range(6)]
    evidence = Evidence(recordings, np.zeros(1), np.ones(1), np.full(1, 0.001),
                        np.full(1, 0.1)).estimated(2.0, 30, 30.0)
    assert evidence.solve(np.array([0])).shift[0] == pytest.approx(0.05, rel=0.3)
    assert evidence.recording_sd[0] == pytest.approx(
        np.sqrt((2.0 * 0.001 ** 2 + np.sum((places - np.repeat(
            [places[:3].mean(), places[3:].mean()], 3)) ** 2)) / 6.0), rel=0.1)


def test_a_change_of_forty_times_its_prior_is_no_deviation() -> None:
    recordings = [recording(k, [-4.0 * (k > 1)], np.array([[1e6]]), k > 1) for k in range(4)]
    evidence = Evidence(recordings, np.zeros(1), np.ones(1), np.full(1, 0.02), np.full(1, 0.1))
    found = evidence.estimated(2.0, 30, settings().fit['recording_free'])
    assert found.recording_sd[0] < 0.021
    assert found.change_sd[0] == 0.1


def test_recordings_that_say_nothing_leave_what_is_assumed() -> None:
    """A limit that is not reached may end anywhere."""
    nothing = np.zeros((1, 1))
    recordings = [recording(k, [float(k)], nothing, k > 2) for k in range(6)]
    evidence = Evidence(recordings, np.zeros(1), np.ones(1), np.full(1, 0.02), np.full(1, 0.1))
    assert evidence.estimated(2.0, 30, 30.0).recording_sd[0] == pytest.approx(0.02)


def test_where_all_differ_more_so_does_what_no_recording_tells() -> None:
    """Rough ground makes recordings differ in everything."""
    rng = np.random.default_rng(3)
    precise = np.diag([1e6] * 20 + [0.0])
    recordings = [recording(k, [*(0.08 * rng.standard_normal(20)), 0.0], precise, k > 2)
                  for k in range(6)]
    evidence = Evidence(recordings, np.zeros(21), np.ones(21), np.full(21, 0.01),
                        np.full(21, 0.1))
    found = evidence.estimated(4.0, 20, 30.0).recording_sd
    assert found[:20].mean() == pytest.approx(0.08, rel=0.15)
    assert found[20] == pytest.approx(0.08, rel=0.25)
    half = replace(evidence, quadratics=[one.less(0.995 * one.place) for one in recordings])
    assert half.estimated(4.0, 20, 30.0).recording_sd[20] == pytest.approx(0.01)


def test_derivatives_that_promise_what_is_not_there_are_no_deviation() -> None:
    """The fits have ended alike in each set, though their derivatives say they are far apart."""
    shift, promised = 0.1, 0.3
    curvature = np.array([[1e6]])
    recordings = []
    for k in range(4):
        one = recording(k, [shift * (k > 1)], curvature, k > 1)
        recordings.append(replace(one, slope=one.slope + curvature[0] * promised * (-1.0) ** k))
    evidence = Evidence(recordings, np.zeros(1), np.ones(1), np.array([0.003]),
                        np.array([0.1])).estimated(2.0, 30, 30.0)
    assert evidence.recording_sd[0] < 0.003
    solution = evidence.solve(np.array([0]))
    assert solution.shift[0] == pytest.approx(shift, abs=0.01)
    assert solution.evidence - evidence.nothing > 10.0


@pytest.mark.parametrize('alone', [True, False])
def test_what_one_recording_says_alone_is_told_by_none(alone: bool) -> None:
    """A change that all later recordings show is told without any of them."""
    later = [0.0, 0.0, 0.3] if alone else [0.1, 0.1, 0.1]
    recordings = [recording(k, [(0.0, 0.0, 0.0, *later)[k]], np.array([[1e4]]), k > 2)
                  for k in range(6)]
    evidence = Evidence(recordings, np.zeros(1), np.ones(1), np.full(1, 0.02), np.full(1, 0.1))
    changed, none = np.array([0]), np.zeros(0, dtype=np.intp)
    gain = evidence.solve(changed).evidence - evidence.nothing
    assert gain > 5.0
    assert evidence.told(changed, none) < 0.0 if alone else evidence.told(
        changed, none) > 0.5 * gain


def test_a_set_of_one_recording_tells_by_all_of_them() -> None:
    recordings = [recording(k, [0.1 * (k > 1)], np.array([[1e4]]), k > 1) for k in range(3)]
    evidence = Evidence(recordings, np.zeros(1), np.ones(1), np.full(1, 0.02), np.full(1, 0.1))
    changed, none = np.array([0]), np.zeros(0, dtype=np.intp)
    assert evidence.told(changed, none) == evidence.solve(changed).evidence - evidence.nothing


@pytest.mark.parametrize('lasts', [True, False])
def test_a_limit_that_one_recording_exceeds_in_most_of_its_stretches_is_told(lasts: bool) -> None:
    """Of the robot before, one recording is slower than the limit that it has after."""
    places, curvatures = [0.0, 3.9, -0.2, -0.2], [0.0, 1e3, 1e4, 1e4]
    recordings = [recording(k, [place], np.array([[curvature]]), k > 1)
                  for k, (place, curvature) in enumerate(zip(places, curvatures, strict=True))]
    recordings[1] = replace(recordings[1], lasting={0: 0.8 if lasts else 0.0})
    evidence = Evidence(recordings, np.zeros(1), np.ones(1), np.full(1, 0.05), np.full(1, 0.7))
    changed, none = np.array([0]), np.zeros(0, dtype=np.intp)
    gain = evidence.solve(changed).evidence - evidence.nothing
    told = evidence.told(changed, none)
    assert gain > 50.0
    assert told > 0.7 * gain if lasts else told < 5.0


def test_what_a_recording_tells_of_more_than_a_limit_it_tells_alone() -> None:
    """It reaches one limit of two, and exceeds the other."""
    recordings = [recording(k, (3.9, 0.5) if k == 1 else (-0.2, 0.0),
                            np.diag([1e4 * (k > 0), 1e4 * (k == 1)]), k > 1) for k in range(4)]
    recordings[1] = replace(recordings[1], lasting={0: 0.8})
    evidence = Evidence(recordings, np.zeros(2), np.ones(2), np.full(2, 0.05), np.full(2, 0.7))
    none = np.zeros(0, dtype=np.intp)
    assert evidence.told(np.array([0]), none) > 50.0
    assert evidence.told(np.array([0, 1]), none) < 5.0
    assert evidence.told(np.array([1]), np.array([0])) < 5.0
