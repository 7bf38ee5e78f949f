# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""An encoder whose factor changes goes on from what it has counted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from lg_husky_sim.diagnosis.evidence.counted_angles import counted, shares
from lg_husky_sim.diagnosis.evidence.drives import Channel, Drive, drives_of
from lg_husky_sim.diagnosis.evidence.observation import observe, simulate
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.hypotheses.hypothesis import entries_of
from lg_husky_sim.husky.effects import Effect, Onset, OnsetKind
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.recording import Recording
import numpy as np
import pytest

FACTOR = 1.08


@pytest.fixture(scope='module')
def ticking(drive: Callable[..., Recording]) -> Drive:
    """Return a drive whose wheels are known by their angles alone."""
    recording = drive('ahead', 'nothing', 1)
    (one,) = drives_of([replace(recording, streams={
        name: series for name, series in recording.streams.items() if name != 'wheels'})])
    assert one.counted
    return one


def misread(onset: Onset | None, factor: float = FACTOR) -> Plant:
    """Return a robot whose left encoder has another factor from an onset on."""
    model = load_model()
    effect = Effect('encoder_scale', 'left', late=onset is not None)
    return compile_model(model.structure.with_effect(effect, onset)).at(
        model.parameters.with_entries(*entries_of(effect, {'encoder_factor': factor})))


@pytest.mark.parametrize('kind', list(OnsetKind))
@pytest.mark.parametrize('delay', [0.0, 0.013])
def test_it_goes_on_where_it_was_and_by_its_factor_from_then_on(
        ticking: Drive, kind: OnsetKind, delay: float) -> None:
    x = ticking.measured[ticking.slice_of(Channel.X)]
    onset = Onset(kind, ticking.start + 7.3 if kind is OnsetKind.TIME else float(
        x[0] + 0.6 * (np.max(x) - x[0])))
    reading = Reading(values={'delay_wheels': delay})
    left, right = (ticking.slice_of(c) for c in (Channel.ANGLE_LEFT, Channel.ANGLE_RIGHT))
    motion = simulate(misread(onset), ticking, reading)
    seen = observe(motion, ticking, reading)
    true = observe(simulate(misread(onset, 1.0), ticking, reading), ticking, reading)
    np.testing.assert_array_equal(seen[right], true[right])
    turned, found = np.diff(true[left]), np.diff(seen[left])
    share = motion.shares('wheels')[1:]
    assert np.any(share == 0.0)
    assert np.any(share == 1.0)
    np.testing.assert_allclose(found, turned * (1.0 + (FACTOR - 1.0) * share), atol=1e-12)
    assert seen[left][0] == pytest.approx(true[left][0], abs=1e-3)


def test_what_a_reading_has_of_an_onset_grows_with_the_time_since_it() -> None:
    times = np.array([0.0, 1.0, 2.0, 3.0])
    for after, expected in ((0.25, 0.75), (0.0, 1.0), (0.999, 0.001)):
        found = shares(Onset(OnsetKind.TIME, 1.0 + after), times, np.zeros(4))
        np.testing.assert_allclose(found, [0.0, 0.0, expected, 1.0], atol=1e-12)
    back = np.array([0.0, 1.0, 0.5, -1.0])
    np.testing.assert_allclose(shares(Onset(OnsetKind.PLACE_ABOVE, 0.25), times, back),
                               [0.0, 0.75, 1.0, 1.0 / 6.0])
    np.testing.assert_allclose(shares(Onset(OnsetKind.PLACE_BELOW, 0.25), times, back),
                               [1.0, 0.25, 0.0, 5.0 / 6.0])
    np.testing.assert_array_equal(shares(Onset(OnsetKind.PLACE_ABOVE, 0.0), times, np.zeros(4)),
                                  np.ones(4))


def test_a_factor_that_does_not_change_is_one_of_the_angle() -> None:
    angles, late = np.array([2.0, 2.5, 4.0]), np.array([0.0, 0.5, 1.0])
    np.testing.assert_array_equal(counted(angles, 2.0, [1.1], late), 2.0 + 1.1 * (angles - 2.0))
    np.testing.assert_allclose(counted(angles, 2.0, [1.0, 2.0], late), [2.0, 2.75, 5.75])
