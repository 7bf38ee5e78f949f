# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""An .mcap file that was cut off: its whole records, as a file that can be read."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
import shutil
import struct
from typing import BinaryIO

#: First and last bytes of every MCAP file.
MAGIC = b'\x89MCAP0\r\n'
#: Records by their code (MCAP specification, "Records").
_FOOTER, _CHUNK, _DATA_END = 0x02, 0x06, 0x0F
_HEAD = struct.Struct('<BQ')
#: What begins a chunk: first and last time, size, checksum, length of the name of its compression;
#: where that has none, the length of its records follows, and then these.
_PLAIN = struct.Struct('<QQQIIQ')
#: What ends a file without an index: no checksum, no summary.
_END = (_HEAD.pack(_DATA_END, 4) + b'\0' * 4 + _HEAD.pack(_FOOTER, 20) + b'\0' * 20 + MAGIC)


def is_cut_off(path: Path) -> bool:
    """Return whether a file begins as MCAP and does not end as such."""
    with path.open('rb') as file:
        begins = file.read(len(MAGIC)) == MAGIC
        size = file.seek(0, 2)
        file.seek(max(0, size - len(MAGIC)))
        return begins and (size < 2 * len(MAGIC) or file.read() != MAGIC)


def records(file: BinaryIO, size: int, place: int = len(MAGIC)
            ) -> Iterator[tuple[int, int, int]]:
    """Yield code, place behind the head and length of each whole record of a file of a size."""
    while place + _HEAD.size <= size:
        file.seek(place)
        code, length = _HEAD.unpack(file.read(_HEAD.size))
        place += _HEAD.size
        if place + length > size:
            return
        yield code, place, length
        place += length


def _whole(file: BinaryIO, size: int, begin: int = len(MAGIC)) -> int:
    # Where the last whole record of the data, or of a chunk, ends.
    end = begin
    for code, place, length in records(file, size, begin):
        if code in (_DATA_END, _FOOTER):
            break
        end = place + length
    return end


def _cut_chunk(file: BinaryIO, size: int, place: int) -> tuple[int, int]:
    # Where the whole records of a chunk that was cut off begin and end.
    file.seek(place)
    head = file.read(_HEAD.size + _PLAIN.size)
    begin = place + _HEAD.size + _PLAIN.size
    if begin > size or head[0] != _CHUNK or _PLAIN.unpack(head[_HEAD.size:])[4]:
        return size, size  # compressed, or no chunk
    return begin, _whole(file, size, begin)


def salvage(path: Path, folder: Path) -> Path:
    """
    Copy the whole records of a file that was cut off, and end the copy properly.

    Chunks are records: the copy holds everything up to the last whole chunk, and the whole
    records of the one that was cut off if they are not compressed.

    Parameters
    ----------
    path : Path
        Not changed.
    folder : Path
        Where the copy goes, under the same name.

    Returns
    -------
    Path
        Of the copy.

    """
    made = folder / path.name
    with path.open('rb') as file, made.open('wb') as copy:
        size = file.seek(0, 2)
        end = _whole(file, size)
        first, last = _cut_chunk(file, size, end)
        file.seek(0)
        shutil.copyfileobj(file, copy)
        copy.truncate(end)
        copy.seek(end)
        file.seek(first)
        copy.write(file.read(last - first) + _END)
    return made
