# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Bags that are called alike are told apart by their folders."""

from __future__ import annotations

from pathlib import Path

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.recording import named_apart, named_as_in, Recording
import pytest


def _read(*paths: str) -> list[Recording]:
    return [Recording(Path(path).stem, path, {}, 0) for path in paths]


@pytest.mark.parametrize(('groups', 'names'), [
    ([['/d/one', '/d/two']], [['one', 'two']]),
    ([['/mon/drive', '/tue/drive', '/tue/spin']], [['mon/drive', 'tue/drive', 'spin']]),
    ([['/a/bag/rec', '/b/bag/rec']], [['a/bag/rec', 'b/bag/rec']]),
    ([['/after/rec1', '/after/rec2'], ['/before/rec1', '/before/old']],
     [['rec1', 'rec2'], ['before/rec1', 'old']]),
    ([['/rec'], ['/x/rec']], [['rec'], ['x/rec']]),
    ([['/data/drive', '/backup/data/drive']], [['/data/drive', 'backup/data/drive']]),
    ([['/x/one'], ['/y/data/drive', '/data/drive']],
     [['one'], ['y/data/drive', '/data/drive']]),
    ([['/d/drive', '/d/drive.mcap']], [['/d/drive', '/d/drive.mcap']]),
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


def test_links_to_different_bags_are_different(tmp_path: Path) -> None:
    """The name comes from where a link leads, and so does the place."""
    for folder, link in (('mon', 'one'), ('tue', 'two')):
        (tmp_path / folder / 'rec').mkdir(parents=True)
        (tmp_path / link).symlink_to(tmp_path / folder / 'rec')
    given = [Recording('rec', str(tmp_path / link), {}, 0) for link in ('one', 'two')]
    assert [one.name for one in named_apart(given)[0]] == ['mon/rec', 'tue/rec']


def test_a_model_finds_its_recordings_again() -> None:
    """By the longest name that it knows; others keep their own."""
    known = ('rec1', 'before/rec1', '/d/old')
    found = named_as_in(_read('/d/before/rec1', '/d/after/rec1', '/d/old', '/e/old'), known)
    assert [one.name for one in found] == ['before/rec1', 'rec1', '/d/old', 'old']
