# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Bags that are called alike are told apart by their folders."""

from __future__ import annotations

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.recording import named_apart, Recording
import pytest


def _read(*paths: str) -> list[Recording]:
    return [Recording(path.rsplit('/', 1)[-1], path, {}, 0) for path in paths]


@pytest.mark.parametrize(('groups', 'names'), [
    ([['/d/one', '/d/two']], [['one', 'two']]),
    ([['/mon/drive', '/tue/drive', '/tue/spin']], [['mon/drive', 'tue/drive', 'spin']]),
    ([['/a/bag/rec', '/b/bag/rec']], [['a/bag/rec', 'b/bag/rec']]),
    ([['/after/rec1', '/after/rec2'], ['/before/rec1', '/before/old']],
     [['rec1', 'rec2'], ['before/rec1', 'old']]),
    ([['/rec'], ['/x/rec']], [['rec'], ['x/rec']]),
])
def test_as_few_folders_as_needed(groups: list[list[str]], names: list[list[str]]) -> None:
    found = named_apart(*(_read(*group) for group in groups))
    assert [[one.name for one in group] for group in found] == names
    assert [[one.path for one in group] for group in found] == groups


def test_a_recording_of_its_own_name_stays_the_same_object() -> None:
    given = _read('/d/one')
    assert named_apart(given)[0][0] is given[0]


@pytest.mark.parametrize('groups', [
    (['/d/rec', '/d/rec'],), (['/d/rec'], ['/d/rec']), (['/d/rec', '/d/../d/rec'],)])
def test_a_recording_given_twice_is_refused(groups: tuple[list[str], ...]) -> None:
    with pytest.raises(RecordingError, match='rec is given twice'):
        named_apart(*(_read(*group) for group in groups))
