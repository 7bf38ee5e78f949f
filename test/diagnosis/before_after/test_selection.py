# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Several changes at once: adopted one on top of another, and dropped where others do for them."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.diagnosis.before_after.base import base_of
from lg_husky_sim.diagnosis.before_after.comparison import Block, Candidate
from lg_husky_sim.diagnosis.before_after.selection import remembered, select
from lg_husky_sim.diagnosis.before_after.settings import Change, settings
from lg_husky_sim.diagnosis.before_after.whitening import first_noise
from lg_husky_sim.husky.model_file import load_model
import numpy as np
import pytest

KNOWN = settings()
BASE = base_of(KNOWN, load_model().parameters)
LATENCY, CURRENT, SAG = (next(one for one in KNOWN.changes if one.effect == effect) for effect in (
    'command_latency', 'current_limit', 'battery_sag'))


def weighed(change: Change, gain: float, chance: float) -> Candidate:
    """Return a change with a gain."""
    n = len(change.parameters)
    return Candidate(change, change.parameters, gain, gain, np.zeros(n), np.ones(n), np.ones(n),
                     chance)


def said(gain: Callable[[frozenset[str]], float], chance: float = 1e-6,
         chance_fitted: float | None = None, anything: float = 0.0
         ) -> tuple[list[str], list[tuple[str, ...]]]:
    """
    Return what is named where sets of changes gain so much together, and what was fitted.

    Everything gains `anything`, beyond chance unless that is nothing.
    """
    fits: list[tuple[str, ...]] = []

    def compared(adopted: tuple[Change, ...], fitted: tuple[Change, ...]) -> tuple[None, Block]:
        fits.append(tuple(one.effect for one in fitted))
        there = frozenset(one.effect for one in adopted)
        known = gain(there)
        candidates = sorted((
            weighed(one, gain(there | {one.effect}) - known,
                    chance_fitted if one in fitted and chance_fitted is not None else chance)
            for one in (LATENCY, CURRENT, SAG) if one.effect not in there),
            key=lambda one: -one.gain)
        return None, Block(BASE, BASE.start, BASE.start, first_noise(KNOWN), tuple(candidates),
                           known, anything, 1e-6 if anything else 1.0)
    found = select(remembered(compared), KNOWN).decisions
    return ['unknown' if one.named is None else one.named.change.effect for one in found
            if one.named is not None or one.unknown > 0.0], fits


def added(**gains: float) -> Callable[[frozenset[str]], float]:
    """Return the gain of changes that do not touch each other."""
    return lambda there: sum(gains.get(one, 0.0) for one in there)


def test_changes_are_named_one_on_top_of_another_by_their_gain() -> None:
    assert said(added(command_latency=90.0, current_limit=200.0))[0] == [
        'current_limit', 'command_latency']


@pytest.mark.parametrize('other', [0.0, 199.0 * KNOWN.decision['further_share']])
def test_what_the_law_of_a_change_leaves_is_no_second_one(other: float) -> None:
    assert said(added(command_latency=other, current_limit=200.0))[0] == ['current_limit']


def test_a_change_that_others_make_up_for_is_dropped() -> None:
    """It gains most by itself, and nothing beside the two that are there."""
    def gain(there: frozenset[str]) -> float:
        if {'command_latency', 'battery_sag'} <= there:
            return 300.0
        return max([0.0, *(value for name, value in (
            ('current_limit', 120.0), ('command_latency', 100.0), ('battery_sag', 90.0))
            if name in there)]) + 60.0 * (len(there) > 1)
    assert sorted(said(gain)[0]) == ['battery_sag', 'command_latency']


def test_nothing_is_named_by_chance() -> None:
    assert said(added(command_latency=90.0), chance=0.5)[0] == []


def test_recordings_are_fitted_again_with_what_a_nominal_robot_has_not() -> None:
    """And only with that: what a fit estimates anyway is in the fits."""
    names, fits = said(added(battery_sag=200.0, command_latency=90.0))
    assert names == ['battery_sag', 'command_latency']
    assert set(fits) == {(), ('battery_sag',)}


@pytest.mark.parametrize(('before', 'fitted', 'names'), [
    (0.05, 1e-6, ['battery_sag']), (1e-3, 0.05, [])])
def test_what_a_nominal_robot_has_not_is_weighed_by_a_fit_with_it(
        before: float, fitted: float, names: list[str]) -> None:
    """Not by a derivative where there is none of it, whether that makes little or much of it."""
    assert said(added(battery_sag=90.0), before, fitted)[0] == names


@pytest.mark.parametrize(('latency', 'current', 'name'), [
    (10.0, 130.0, 'current_limit'), (10.0, 90.0, 'unknown'), (128.0, 130.0, 'unknown')])
def test_of_a_difference_beyond_chance_the_name_that_makes_up_most_is_said(
        latency: float, current: float, name: str) -> None:
    """Though its own gain is not beyond chance: if it explains most, and more than others do."""
    gains = added(command_latency=latency, current_limit=current)
    assert said(gains, chance=0.05, anything=200.0)[0] == [name]
    assert said(gains, chance=0.05)[0] == []
