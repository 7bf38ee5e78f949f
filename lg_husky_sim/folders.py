# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Results that appear whole or not at all, beside whatever else lies there."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import sha256
from os import replace
from pathlib import Path
import re
import shutil
import tempfile

from lg_husky_sim.errors import SettingsError

_WRITTEN = 'written by lg_husky, which replaces it unless it was changed: sha256 '


def check_folder(path: Path) -> None:
    """
    Check that results can be written to a folder, before the work that makes them.

    Parameters
    ----------
    path : pathlib.Path
        Does not exist or is a folder, but no recording.

    Raises
    ------
    SettingsError
        If something else is there, or nothing can be written there.

    """
    if (path.exists() or path.is_symlink()) and not path.is_dir():
        raise SettingsError(f'{path} exists and is not a folder; choose another name')
    if (path / 'metadata.yaml').is_file():
        raise SettingsError(f'{path} is a recording; choose another folder for the results')
    check_writable(path)


def check_writable(path: Path) -> None:
    """
    Check that a file or folder can be made or replaced, before the work for it.

    Parameters
    ----------
    path : pathlib.Path
        Folders that it is in need not exist.

    Raises
    ------
    SettingsError
        If nothing can be written there.

    """
    target = path.parent.resolve() if path.is_file() else path.resolve()
    there = next(one for one in (target, *target.parents) if one.exists())
    try:
        tempfile.TemporaryDirectory(prefix='.lg_husky.', dir=there).cleanup()
    except OSError as error:
        raise SettingsError(f'{path} cannot be written: {there}: {error.strerror}') from error


def check_ours(path: Path, beginning: str) -> None:
    """
    Check that a single file may be written: none is there, or a result of an earlier run.

    Parameters
    ----------
    path : pathlib.Path
        File that is to be written.
    beginning : str
        With which every such result begins; '' where none can be there. An empty file may go.

    Raises
    ------
    SettingsError
        If something else is there.

    """
    if path.is_dir():
        raise SettingsError(f'{path} is a folder; choose another name')
    if not path.exists():
        return
    if path.is_file():
        with path.open('rb') as file:
            head = file.read(max(1, len(beginning.encode())))
        if not head or (beginning and head == beginning.encode()):
            return
    raise SettingsError(f'{path} exists and is no such result of lg_husky; choose another name')


def signed(text: str, comment: str = '# {}') -> str:
    """
    Return a text with one more line, by which it shows whether somebody changed it since.

    Parameters
    ----------
    text : str
        Ends with a line break.
    comment : str
        How a comment is written in it.

    Returns
    -------
    str

    """
    return f'{text}{comment.format(_WRITTEN + sha256(text.encode()).hexdigest()[:32])}\n'


def is_unchanged(path: Path) -> bool:
    """Return whether a file ends with the line of :func:`signed`, and is as it was then."""
    text, _, last = path.read_bytes().removesuffix(b'\n').rpartition(b'\n')
    found = re.search(_WRITTEN.encode() + b'([0-9a-f]{32})', last)
    return found is not None and sha256(text + b'\n').hexdigest()[:32].encode() == found[1]


def check_unchanged(path: Path, beginning: str) -> None:
    """
    Check that a single text file may be written: none is there, or a result nobody changed.

    Parameters
    ----------
    path : pathlib.Path
        File that is to be written, as :func:`signed` returns it.
    beginning : str
        With which every such result begins. An empty file may go, too.

    Raises
    ------
    SettingsError
        If something else is there, such as a file written by hand that begins like a result.

    """
    check_ours(path, beginning)
    _refuse_changed(path)


def _refuse_changed(path: Path) -> None:
    if path.is_file() and path.stat().st_size and not is_unchanged(path):
        raise SettingsError(f'{path} exists and was written or changed by hand, or by an older '
                            'lg_husky; choose another name')


def check_marked(path: Path, mark: str, *, text: bool = False) -> None:
    """
    Check that a single file may be written: none is there, or one that has a mark of ours in it.

    Parameters
    ----------
    path : pathlib.Path
        File that is to be written.
    mark : str
        Such as the schema. An empty file may go, too.
    text : bool
        Whether it is as :func:`signed` returns it, so that one changed by hand can be told.

    Raises
    ------
    SettingsError
        If something else is there.

    """
    if path.is_file() and mark.encode() in path.read_bytes():
        if text:
            _refuse_changed(path)
        return
    check_ours(path, '')


@contextmanager
def scratch_beside(path: Path) -> Iterator[Path]:
    """
    Make a scratch folder for what becomes a file or folder, on its file system.

    Parameters
    ----------
    path : pathlib.Path
        What shall be written; the folder that it is in is made.

    Yields
    ------
    pathlib.Path
        Removed when the block ends, with what is still in it.

    Raises
    ------
    OSError
        If nothing can be written there; it names `path`, not the scratch folder.

    """
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        holder = tempfile.TemporaryDirectory(prefix=f'.{path.name}.', dir=path.parent)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error
    with holder as scratch:
        yield Path(scratch)


@contextmanager
def result_folder(path: Path, marker: str) -> Iterator[Path]:
    """
    Make a folder of results, whole or not at all.

    Parameters
    ----------
    path : pathlib.Path
        Where it shall be. Results of an earlier run are replaced at the end; other files and
        changed models stay, and one that has the name of a result gets a ``~`` or more behind
        its own.
    marker : str
        Name of the file that is there only if all others are, such as ``compare.json``; the
        caller writes it too.

    Yields
    ------
    pathlib.Path
        A scratch folder to write to, beside it or, where it exists, in it (it may be another file
        system than what is beside it); what is in it becomes the results when the block ends
        without an exception, and is removed otherwise.

    Raises
    ------
    SettingsError
        If something else is at `path`, or a recording, or nothing can be written there.

    """
    target = path.resolve()
    check_folder(target)
    target.parent.mkdir(parents=True, exist_ok=True)
    place = target if target.is_dir() else target.parent
    with tempfile.TemporaryDirectory(prefix=f'.{target.name}.', dir=place) as scratch:
        made = Path(scratch) / 'made'
        made.mkdir()
        yield made
        check_folder(target)
        names = sorted((one.name for one in made.iterdir()), key=lambda name: name == marker)
        (made / _list_of(marker)).write_text(
            ''.join(f'{name}\n' for name in names), encoding='utf-8', errors='surrogateescape')
        if target.exists():
            _install(made, target, [_list_of(marker), *names])
        else:
            replace(made, target)


def _list_of(marker: str) -> str:
    # What an earlier run wrote, so that the next one replaces that and nothing else.
    return f'.{marker}.files'


def _install(made: Path, target: Path, names: list[str]) -> None:
    # The list comes first and the marker last: without it, nobody takes the rest for results.
    listed = target / names[0]
    there = {one.name for one in target.iterdir()}
    mine = there & {names[0]}
    if listed.is_file():
        mine |= there & {*listed.read_text('utf-8', 'surrogateescape').splitlines()}
    mine -= {name for name in mine if _by_hand(target / name)}
    for name in mine - set(names[:-1]):
        _remove(target / name)
    for name in names:
        old, new = target / name, made / name
        if name in there - mine:
            replace(old, _free(target, name))
        elif name in mine and (old.is_dir() or new.is_dir()):
            _remove(old)
        replace(new, old)


def _by_hand(path: Path) -> bool:
    # Models are what people change in a folder of results.
    return path.suffix == '.yaml' and path.is_file() and not is_unchanged(path)


def _free(folder: Path, name: str) -> Path:
    # The name with as many tildes behind it as it takes to be nobody's.
    kept = folder / f'{name}~'
    while kept.exists() or kept.is_symlink():
        kept = kept.with_name(f'{kept.name}~')
    return kept


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
