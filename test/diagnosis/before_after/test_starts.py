# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Where fits begin, and of which kind the robot is."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from lg_husky_sim.diagnosis.before_after.base import Base, base_of
from lg_husky_sim.diagnosis.before_after.drives import Drive, drives
from lg_husky_sim.diagnosis.before_after.fitting import Prior
from lg_husky_sim.diagnosis.before_after.motion import moved
from lg_husky_sim.diagnosis.before_after.prediction import predicted
from lg_husky_sim.diagnosis.before_after.robot_kinds import kinds_of, of_likeliest_kind
from lg_husky_sim.diagnosis.before_after.settings import settings
from lg_husky_sim.diagnosis.before_after.starts import starts_from
from lg_husky_sim.diagnosis.before_after.whitening import first_noise
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np
from numpy.typing import NDArray
import pytest

BASE = base_of(settings(), load_model().parameters)
LOOP = [BASE.names.index(name) for name in ('loop_gain', 'loop_integral')]
ALL = np.ones(BASE.start.size, dtype=np.bool_)


def place(**values: float) -> FloatArray:
    """Return the start with some parameters at other values, on the scale of the estimates."""
    found = np.array(BASE.start)
    for name, value in values.items():
        found[BASE.names.index(name)] = BASE.place(name, value)
    return found


def drive_of(base: Base, z: FloatArray, name: str) -> Drive:
    """Return what encoders read of a robot that is driven to and fro."""
    rng = np.random.default_rng(len(name))
    times = np.arange(0.0, 12.0, 0.05)
    held = np.repeat(rng.uniform(-0.8, 0.8, (12, 2)), 20, axis=0)
    at = np.arange(0.0, 12.0, 0.02)
    streams = {'command': TimeSeries(times, held, ('forward', 'yaw')),
               'wheels': TimeSeries(at, np.zeros((at.size, 2)), ('left', 'right'))}
    known = settings()
    (empty,) = drives(Recording(name, name, streams, 0), known.simulation['step'], known.bins,
                      0.5, 3.0)
    robot = base.values(z)[None]
    read = predicted(base, empty, robot, moved(base, empty, robot))['wheels'][..., 0]
    return replace(empty, bins={'wheels': replace(empty.bins['wheels'], values=read)})


@pytest.mark.parametrize('free', [ALL, np.array([q.name in settings().body
                                                 for q in settings().quantities])])
def test_starts_from_two_places_are_pairs(free: NDArray[np.bool_]) -> None:
    here = starts_from(BASE, free, BASE.start)
    there = starts_from(BASE, free, place(current_limit=12.0))
    assert [len(kind) for kind in here] == [len(kind) for kind in there]
    assert np.array_equal(here[0], [BASE.start])
    assert len(here) > 5
    for kind in here[1:]:
        for start in kind:
            changed = start != BASE.start
            assert np.any(changed)
            assert not np.any(changed & ~free)


def test_a_limit_begins_in_several_sizes_inside_its_bounds() -> None:
    limit = BASE.names.index('current_limit')
    kinds = [kind for kind in starts_from(BASE, ALL, place(current_limit=0.6))
             if all(start[limit] < place(current_limit=0.6)[limit] for start in kind)]
    assert max(len(kind) for kind in kinds) > 2
    assert min(start[limit] for kind in kinds for start in kind) == BASE.bounds()[0][limit]


@pytest.mark.parametrize(('true', 'ended', 'kind'), [
    ({'loop_gain': 2.0, 'loop_integral': 8.0}, {'loop_gain': 0.001, 'loop_integral': 6.0}, 0),
    ({'loop_gain': 0.001, 'loop_integral': 0.001}, {'loop_gain': 0.1, 'loop_integral': 0.2}, 1),
])
def test_all_recordings_tell_whether_there_is_a_loop(
        true: dict[str, float], ended: dict[str, float], kind: int) -> None:
    """Whichever kind the first fit took them for."""
    free = np.isin(np.arange(ALL.size), [*LOOP, BASE.names.index('loop_feedforward')])
    kinds = [prior for _, prior in kinds_of(BASE, Prior(BASE.start, BASE.sd, free), BASE.start)]
    assert len(kinds) == 2
    groups = {name: [drive_of(BASE, place(**true), name)] for name in ('a', 'bb')}
    lags = {name: np.zeros(ALL.size) for name in groups}
    with ThreadPoolExecutor(2) as pool:
        for known in kinds:
            places, found = of_likeliest_kind(
                BASE, groups, first_noise(settings()), {name: place(**ended) for name in groups},
                lags, known, kinds, pool)
            assert found is kinds[kind]
            for z in places.values():
                assert np.allclose(z[LOOP], place(**true)[LOOP], atol=0.7)


def test_where_kinds_do_not_differ_nothing_is_fitted() -> None:
    prior = Prior(BASE.start, BASE.sd, ~ALL)
    places = {'a': BASE.start}
    with ThreadPoolExecutor(1) as pool:
        kept = of_likeliest_kind(BASE, {}, first_noise(settings()), places, {}, prior,
                                 [prior, replace(prior)], pool)
    assert kept == (places, prior)
