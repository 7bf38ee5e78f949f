# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What is kept of a drive, and what makes room for it."""

from __future__ import annotations

from functools import partial

from lg_husky_sim.diagnosis.evidence import memory as memory_module
from lg_husky_sim.diagnosis.evidence.memory import Memory, Rows
from lg_husky_sim.signals import FloatArray
import numpy as np
import pytest


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave room for three rows of a hundred numbers, and for two things of a kind."""
    values = {'motions_kept': 2500e-6, 'readings_kept': 2}
    monkeypatch.setattr(memory_module, 'setting', values.__getitem__)
    monkeypatch.setattr(memory_module, '_ROWS', Rows())


def never() -> FloatArray:
    raise AssertionError('made again')


def rows() -> FloatArray:
    return np.zeros(100)


def test_rows_that_were_asked_for_last_stay() -> None:
    memory = Memory()
    for key in 'abc':
        memory.rows(key, rows)
    kept = memory.rows('a', never)
    assert not kept.flags.writeable
    memory.rows('d', rows)
    for key in 'cda':
        memory.rows(key, never)
    with pytest.raises(AssertionError, match='made again'):
        memory.rows('b', never)


def test_what_takes_all_of_the_room_is_kept_alone() -> None:
    memory = Memory()
    memory.rows('small', rows)
    memory.rows('large', lambda: np.zeros(1000))
    memory.rows('large', never)
    with pytest.raises(AssertionError, match='made again'):
        memory.rows('small', never)
    memory.rows('small', rows)
    memory.rows('other', rows)
    memory.rows('small', never)


def test_rows_that_two_threads_made_at_once_are_counted_once() -> None:
    kept = Rows()
    for _ in range(2):
        kept.keep('a', rows())
    kept.keep('b', rows())
    kept.keep('c', rows())
    assert [kept.taken(key) is not None for key in 'abc'] == [True, True, True]


def test_drives_share_the_room_for_rows() -> None:
    one, other = Memory(), Memory()
    for key in 'ab':
        one.rows(key, rows)
        other.rows(key, rows)
    other.rows('b', never)
    one.rows('b', never)
    with pytest.raises(AssertionError, match='made again'):
        one.rows('a', never)


def test_kinds_do_not_take_each_others_room() -> None:
    memory = Memory()
    assert memory.remembered('ways', 0.1, lambda: 'way') == 'way'
    for number in range(3):
        memory.remembered('wanted', number, partial(str, number))
    assert memory.remembered('ways', 0.1, lambda: 'another') == 'way'
    assert memory.remembered('wanted', 2, lambda: 'another') == '2'
    assert memory.remembered('wanted', 0, lambda: 'another') == 'another'


def test_what_is_nothing_is_remembered_as_well() -> None:
    memory = Memory()
    assert memory.remembered('ways', 1, lambda: 0.0) == 0.0
    assert memory.remembered('ways', 1, lambda: 1.0) == 0.0
