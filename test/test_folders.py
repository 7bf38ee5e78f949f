# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A folder of results appears whole, replaces only its like, and leaves nothing behind."""

from __future__ import annotations

from pathlib import Path

from lg_husky_sim.errors import SettingsError
from lg_husky_sim.folders import check_folder, result_folder
import pytest


def _fill(path: Path, name: str, content: str = 'x') -> None:
    with result_folder(path, 'result.json') as folder:
        (folder / 'result.json').write_text(content)
        (folder / name).write_text(content)


def test_results_appear_and_are_replaced(tmp_path: Path) -> None:
    out = tmp_path / 'deep' / 'out'
    _fill(out, 'first.png')
    _fill(out, 'second.png', 'y')
    assert {path.name for path in out.iterdir()} == {'result.json', 'second.png'}
    assert (out / 'result.json').read_text() == 'y'
    assert [path.name for path in out.parent.iterdir()] == ['out']


def test_an_empty_folder_is_taken(tmp_path: Path) -> None:
    _fill(tmp_path / 'out', 'a')
    (tmp_path / 'empty').mkdir()
    _fill(tmp_path / 'empty', 'a')
    assert (tmp_path / 'empty' / 'result.json').is_file()


def test_a_failure_keeps_the_old_results(tmp_path: Path) -> None:
    out = tmp_path / 'out'
    _fill(out, 'first.png')

    def interrupted() -> None:
        with result_folder(out, 'result.json') as folder:
            (folder / 'result.json').write_text('half')
            raise KeyboardInterrupt
    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert (out / 'result.json').read_text() == 'x'
    assert [path.name for path in tmp_path.iterdir()] == ['out']


def test_what_is_not_ours_is_not_touched(tmp_path: Path) -> None:
    (tmp_path / 'thesis').mkdir()
    (tmp_path / 'thesis' / 'thesis.tex').write_text('mine')
    with pytest.raises(SettingsError, match='thesis is not empty and holds no result'):
        _fill(tmp_path / 'thesis', 'a')
    (tmp_path / 'file').write_text('mine')
    with pytest.raises(SettingsError, match='file exists and is no folder'):
        check_folder(tmp_path / 'file', 'result.json')
    assert (tmp_path / 'thesis' / 'thesis.tex').read_text() == 'mine'
