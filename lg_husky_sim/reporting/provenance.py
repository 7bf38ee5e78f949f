# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a result comes from: version, command, hashes of what was read."""

from __future__ import annotations

from collections.abc import Iterable
import hashlib
from importlib.metadata import PackageNotFoundError, version
import os
from pathlib import Path
import shlex
import sys

from lg_husky_sim.reporting.data import Provenance

#: Read at once while hashing [bytes].
_BLOCK = 1 << 20
#: What the command line is started as: the script, or the module with ``python -m``.
PROGRAM = ('lg_husky', 'main.py')


def content_hash(path: str | os.PathLike[str]) -> str:
    """
    Return the SHA-256 of a file, or of all files of a folder with their names.

    Parameters
    ----------
    path : path
        A file, or a folder such as a rosbag2.

    Returns
    -------
    str
        In hexadecimal; empty where there is nothing to read.

    """
    place = Path(path)
    total = hashlib.sha256()
    inside = sorted(one for one in place.rglob('*') if one.is_file()) if place.is_dir() else []
    for one in inside or [place]:
        if not one.is_file():
            return ''
        if inside:
            total.update(one.relative_to(place).as_posix().encode('utf-8', 'surrogateescape'))
        with one.open('rb') as stream:
            while block := stream.read(_BLOCK):
                total.update(block)
    return total.hexdigest()


def package_version() -> str:
    """Return the version of this package; empty where it runs from a source tree."""
    try:
        return version('lg_husky_sim')
    except PackageNotFoundError:
        return ''


def given_command() -> str:
    """Return the command line of this process as it was typed; empty if it is another program."""
    own = Path(sys.argv[0]).name in PROGRAM
    return shlex.join(['lg_husky', *sys.argv[1:]]) if own else ''


def provenance(recordings: Iterable[tuple[str, str | os.PathLike[str]]],
               models: Iterable[tuple[str, str | os.PathLike[str]]] = (),
               command: str = '') -> Provenance:
    """
    Return where a result comes from.

    Parameters
    ----------
    recordings, models : iterable of (str, str)
        Name and path of each.
    command : str
        That of this process if not given.

    Returns
    -------
    Provenance

    """
    return Provenance(package_version(), command or given_command(), tuple(
        (kind, name, content_hash(path))
        for kind, group in (('recording', recordings), ('model', models))
        for name, path in group if path))
