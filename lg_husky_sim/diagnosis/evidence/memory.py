# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What was worked out about a drive, for as long as there is room for it."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from threading import Lock
from typing import Any, TypeVar

from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.signals import FloatArray

Kept = TypeVar('Kept')


class Rows:
    """The simulated rows that were asked for last, of all drives together."""

    def __init__(self) -> None:
        self._rows: dict[Hashable, FloatArray] = {}
        self._size = 0
        self._keeping = Lock()

    def taken(self, key: Hashable) -> FloatArray | None:
        """Return the rows of a key and keep them no longer."""
        with self._keeping:
            found = self._rows.pop(key, None)
            if found is not None:
                self._size -= found.nbytes
            return found

    def keep(self, key: Hashable, rows: FloatArray) -> None:
        """Keep rows, and those asked for last beside them as far as there is room."""
        with self._keeping:
            room = setting('motions_kept') * 1e6 - rows.nbytes
            while self._rows and self._size > room:
                self._size -= self._rows.pop(next(iter(self._rows))).nbytes
            before = self._rows.pop(key, None)
            self._rows[key] = rows
            self._size += rows.nbytes - (0 if before is None else before.nbytes)


#: Drives are copied, and there are many in a long recording: one room for the rows of all.
_ROWS = Rows()
#: Threads simulate one drive at several points at once.
_KEEPING = Lock()


class Memory:
    """What was made last of a drive, of each kind, and its rows among those of all drives."""

    def __init__(self) -> None:
        self._made: dict[str, dict[Hashable, Any]] = {}
        self._drive = object()

    def remembered(self, kind: str, key: Hashable, make: Callable[[], Kept]) -> Kept:
        """Return what was made under a key, among the last of its kind; else make it."""
        with _KEEPING:
            memory = self._made.setdefault(kind, {})
            if key in memory:
                found: Kept = memory[key]
                return found
        made = make()
        with _KEEPING:
            while len(memory) >= setting('readings_kept'):
                memory.pop(next(iter(memory)))
            memory[key] = made
        return made

    def rows(self, key: Hashable, make: Callable[[], FloatArray]) -> FloatArray:
        """Return the simulated rows of a key if they were among the last ones; else make them."""
        own = (self._drive, key)
        found = _ROWS.taken(own)
        if found is None:
            found = make()
            found.flags.writeable = False
        _ROWS.taken(own)
        _ROWS.keep(own, found)
        return found
