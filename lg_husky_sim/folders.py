# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Folders of results that appear whole or not at all."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from os import replace
from pathlib import Path
import tempfile

from lg_husky_sim.errors import SettingsError


def check_folder(path: Path, marker: str) -> None:
    """
    Check that results may be written to a folder.

    Parameters
    ----------
    path : pathlib.Path
        Does not exist, is empty, or holds results of the same kind.
    marker : str
        Name of a file that every folder of this kind holds, such as ``compare.json``.

    Raises
    ------
    SettingsError
        If something else is there.
    """
    if not path.exists() and not path.is_symlink():
        return
    if not path.is_dir():
        raise SettingsError(f'{path} exists and is no folder; choose another name')
    if any(path.iterdir()) and not (path / marker).is_file():
        raise SettingsError(
            f'{path} is not empty and holds no {marker} of an earlier run; choose another folder')


@contextmanager
def result_folder(path: Path, marker: str) -> Iterator[Path]:
    """
    Make a folder of results, whole or not at all.

    Parameters
    ----------
    path : pathlib.Path
        Where it shall be; results of the same kind that are there are replaced at the end.
    marker : str
        As in `check_folder`; the caller writes this file too.

    Yields
    ------
    pathlib.Path
        A scratch folder beside it to write to; it becomes `path` when the block ends without
        an exception, and is removed otherwise.

    Raises
    ------
    SettingsError
        If something else is at `path`.
    """
    target = path.resolve()
    check_folder(target, marker)
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f'.{target.name}.', dir=target.parent) as scratch:
        made = Path(scratch) / 'made'
        made.mkdir()
        yield made
        check_folder(target, marker)
        if target.exists():
            replace(target, Path(scratch) / 'previous')
        replace(made, target)
