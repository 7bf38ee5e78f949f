# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""When a difference of two sets of recordings is beyond chance."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations, product

from lg_husky_sim.diagnosis.before_after.base import Base, base_of
from lg_husky_sim.diagnosis.before_after.comparison import Block, compare, partitions
from lg_husky_sim.diagnosis.before_after.evidence import Quadratic
from lg_husky_sim.diagnosis.before_after.fitting import Prior
from lg_husky_sim.diagnosis.before_after.judge import (
    chance_of_one,
    exchange_chance,
    is_beyond_chance,
)
from lg_husky_sim.diagnosis.before_after.recording_fits import RecordingFits
from lg_husky_sim.diagnosis.before_after.settings import settings
from lg_husky_sim.diagnosis.before_after.whitening import first_noise
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.signals import FloatArray
import numpy as np
import pytest

NAMES = ('a', 'b', 'c', 'd', 'e', 'f')
LATER = frozenset('def')
#: What each recording says of a parameter, as a share of its assumed deviation.
PRECISION = 0.2


def body() -> Base:
    return base_of(settings(), load_model().parameters, given=True)


def said(places: Mapping[str, FloatArray], later: frozenset[str] = LATER, dull: str = '') -> Block:
    """Return what is made of recordings that are likeliest there; dull ones tell no radius."""
    base = body()
    quantities = settings().quantities
    free = np.array([q.name in settings().body for q in quantities])
    prior = Prior(base.start, base.sd, free)
    precise = np.array([1.0 / (PRECISION * max(q.recording, 1e-4)) ** 2 for q in quantities])
    blind = np.where([q.name == 'radius_left' for q in quantities], 1e-8, 1.0)

    def likely(name: str, z: FloatArray) -> Quadratic:
        curvature = np.diag(precise * (blind if name in dull else 1.0))
        return Quadratic(name, False, z, curvature, curvature @ z, 0.5 * float(z @ curvature @ z))
    return compare(RecordingFits(base, prior, first_noise(settings()), base.start, places, tuple(
        likely(name, z) for name, z in places.items()), ()), later)


def recorded(seed: int, times: float = 1.0, shift: float = 0.0, number: str = 'radius_left'
             ) -> dict[str, FloatArray]:
    """Return recordings that deviate by so much more than assumed, and a change of one number."""
    base, rng = body(), np.random.default_rng(seed)
    deviation = np.array([q.recording for q in settings().quantities])
    places = {name: base.start + times * deviation * rng.standard_normal(deviation.size)
              for name in NAMES}
    for name in LATER:
        places[name][base.names.index(number)] += shift
    return places


def test_robots_that_have_not_changed_are_flagged_at_the_stated_rate() -> None:
    """Though what the base leaves out makes recordings differ by eight times what is assumed."""
    flagged = sum(is_beyond_chance(said(recorded(seed, 8.0)).candidates[0], settings().decision)
                  for seed in range(12))
    assert flagged <= 1  # of 12 at 2 %; two or more have a chance of 2 %


def test_a_change_that_is_no_likelier_than_none_is_chance() -> None:
    """Without any one recording, and with even odds spread over all changes."""
    seen = 0
    for seed, shift in product(range(4), (0.001, 0.0015, 0.002)):
        candidates = said(recorded(seed, 1.0, shift)).candidates
        small = [one for one in candidates if 0.0 < one.told < np.log(len(candidates))]
        assert {one.chance for one in small} <= {1.0}
        seen += len(small)
    assert seen >= 4


def test_a_change_among_deviations_is_named() -> None:
    best = said(recorded(1, 3.0, 0.03)).candidates[0]
    assert (best.change.effect, best.change.side) == ('wheel_radius_mismatch', 'left')
    assert is_beyond_chance(best, settings().decision)
    assert best.shift[0] == pytest.approx(0.03, rel=0.1)


@pytest.mark.parametrize(('shift', 'named'), [(40.0, True), (-40.0, False)])
def test_nothing_changes_to_where_it_cannot_be(shift: float, named: bool) -> None:
    """A drag that pushes neither has a name nor is it something that has changed."""
    block = said(recorded(1, 1.0, shift, 'drag'))
    best = block.candidates[0]
    assert ((best.change.effect, is_beyond_chance(best, settings().decision))
            == ('quadratic_drag', True)) is named
    assert (block.anything > 100.0) is named
    drag = next(one for one in block.candidates if one.change.effect == 'quadratic_drag')
    assert drag.before[0] + drag.shift[0] == pytest.approx(max(shift, 0.0), abs=1.0)
    if not named:
        assert not is_beyond_chance(best, settings().decision)


def test_what_ends_at_its_bound_has_changed() -> None:
    """A resistance of which nothing is left, though a little less would be likelier."""
    places, rolling = recorded(1), body().names.index('rolling')
    for name, place in places.items():
        place[rolling] += -0.016 if name in LATER else 0.05
    best = said(places).candidates[0]
    assert best.change.parameters == ('rolling',)
    assert is_beyond_chance(best, settings().decision)
    assert best.before[0] + best.shift[0] == pytest.approx(0.0, abs=1e-9)


def test_a_difference_between_other_recordings_is_no_change() -> None:
    """Two recordings of each set differ from the rest."""
    places = recorded(2)
    for name in 'aef':
        places[name][body().names.index('radius_left')] += 0.03
    assert not is_beyond_chance(said(places).candidates[0], settings().decision)
    assert is_beyond_chance(said(places, frozenset('aef')).candidates[0], settings().decision)


@pytest.mark.parametrize(('dull', 'named'), [('abf', False), ('bf', True)])
def test_what_one_recording_of_a_set_alone_can_tell_is_no_change(dull: str, named: bool) -> None:
    """It may be an accident of that one; where another one can tell it as well, it is named."""
    places = recorded(1, 0.3)
    for name in 'abc':
        places[name][body().names.index('radius_left')] -= 0.03
    best = said(places, dull=dull).candidates[0]
    assert (best.change.effect, best.change.side) == ('wheel_radius_mismatch', 'left')
    assert best.gain > 100.0
    assert is_beyond_chance(best, settings().decision) is named


def test_which_set_came_first_and_the_order_of_recordings_do_not_matter() -> None:
    places = recorded(3, 1.0, 0.02)
    one = said(places)
    other = said(dict(reversed(places.items())), frozenset('abc'))
    assert one.candidates[0].change == other.candidates[0].change
    assert one.candidates[0].gain == pytest.approx(other.candidates[0].gain, rel=0.02)
    assert one.candidates[0].shift == pytest.approx(-other.candidates[0].shift, rel=0.02)


@pytest.mark.parametrize(('names', 'later', 'count'), [
    ('abcdef', 'def', 9), ('abcd', 'cd', 2), ('ab', 'b', 0), ('abcd', 'd', 3),
    ('abcde', 'de', 9), ('abcdefghijklmnop', 'ijklmnop', 30)])
def test_all_other_ways_to_part_recordings_are_tried(names: str, later: str, count: int) -> None:
    ways = partitions(names, frozenset(later), 30, 4000)
    assert ways == partitions(names[::-1], frozenset(later), 30, 4000)
    assert len({frozenset([way, frozenset(names) - way]) for way in ways}) == count == len(ways)
    assert all(len(way) == len(later) or 2 * len(later) == len(names) for way in ways)
    assert frozenset(later) not in ways
    assert 2 * len(later) != len(names) or frozenset(names) - frozenset(later) not in ways


def test_ways_beyond_those_that_are_listed_are_drawn_without_repetition() -> None:
    drawn = partitions('abcdefgh', frozenset('efgh'), 20, 10)
    assert drawn != partitions('abcdefgh', frozenset('efgh'), 20, 4000)
    assert len({frozenset([way, frozenset('abcdefgh') - way]) for way in drawn}) == 20
    assert all(len(way) == 4 for way in drawn)


def test_a_gain_is_rare_where_it_is_far_above_those_of_other_partitions() -> None:
    """Robots whose gains by chance are of unlike scale are flagged at the stated rate."""
    rng, numbers = np.random.default_rng(4), {'null_weight': 2.0, 'null_gain': 5.0}
    for others in (9, 2, 0):
        scale = 10.0 / rng.gamma(2.0, size=(20000, 1))
        drawn = scale * rng.exponential(size=(20000, others + 1))
        chances = [exchange_chance(row[0], list(row[1:]), numbers) for row in drawn]
        for rate in (0.02, 0.1):
            assert np.mean(np.array(chances) < rate) == pytest.approx(rate, abs=0.006)
    assert exchange_chance(-5.0, [1.0, 2.0], numbers) == 1.0
    assert exchange_chance(1000.0, [-3.0] * 9, numbers) < 1e-15


def test_what_others_gain_by_chance_does_not_hide_a_change_that_does_not() -> None:
    """With as many recordings as tell the one from the others."""
    numbers = {'null_weight': 2.0, 'null_gain': 5.0}
    own, best = [2.0] * 30, [75.0] * 30
    assert chance_of_one(340.0, own, best, 35, 12, numbers) < 1e-3
    assert exchange_chance(340.0, best, numbers) > 0.01
    assert chance_of_one(340.0, own, best, 35, 6, numbers) > 0.01
    assert chance_of_one(340.0, best, best, 35, 12, numbers) == exchange_chance(
        340.0, best, numbers)
    assert chance_of_one(60.0, own, best, 35, 12, numbers) > 0.1
    assert chance_of_one(9.0, [0.0] * 9, [1.0] * 9, 35, 6, numbers) > 0.01
    assert chance_of_one(100.0, [], [], 35, 2, numbers) == exchange_chance(100.0, [], numbers)


def test_of_many_changes_few_are_beyond_chance() -> None:
    """
    Though each has partitions of its own.

    The values of six recordings give all ten of them: where one gains by chance, the others do
    not, since the deviation is estimated from the same values.
    """
    rng, numbers = np.random.default_rng(6), {'null_weight': 2.0, 'null_gain': 2.5}
    ways = [way for way in combinations(range(6), 3) if 0 in way]
    contrast = np.array([[1.0 if k in way else -1.0 for k in range(6)] for way in ways]).T / 3.0
    assumed, flagged = 2.0, []
    for _ in range(1000):
        x = rng.standard_normal((25, 6))
        apart = 1.5 * (x @ contrast) ** 2
        within = 6.0 * np.var(x, axis=1)[:, None] - apart
        gain = np.maximum(0.5 * apart * (assumed + 4.0) / (assumed + within) - 1.0, 0.0)
        best = list(gain[:, 1:].max(axis=0))
        flagged.append(min(chance_of_one(row[0], list(row[1:]), best, 25, 6, numbers)
                           for row in gain) < 0.02)
    assert np.mean(flagged) < 0.02


def test_what_has_changed_is_not_taken_for_chance() -> None:
    """
    The other partitions mix recordings before and after a change.

    A parameter that has no deviation from recording to recording then gains in all of them.
    """
    places = recorded(5)
    for name in LATER:
        places[name][body().names.index('track')] += 0.1
    block = said(places)
    before, after = (dict(zip(block.base.names, z, strict=True)) for z in (
        block.before, block.after))
    assert after['track'] - before['track'] == pytest.approx(0.1, rel=0.05)
    assert block.chance < 1e-6
