# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Threads for simulations, which run without the interpreter's lock."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
import threading
from typing import Any, TypeVar

from lg_husky_sim.blas import one_thread
from lg_husky_sim.heap import kept_memory

Outcome = TypeVar('Outcome')


class Threads(ThreadPoolExecutor):
    """
    Threads whose tasks may map tasks of their own.

    Those run in the thread that asks, and so do all that are mapped after the end.

    Parameters
    ----------
    jobs : int
        How many; at least one.

    """

    def __init__(self, jobs: int) -> None:
        self._own, self._ended = threading.local(), False
        super().__init__(max(jobs, 1), initializer=self._enter)

    def _enter(self) -> None:
        self._own.busy = True

    def map(self, function: Callable[..., Outcome], *tasks: Iterable[Any],  # noqa: A003
            timeout: float | None = None, chunksize: int = 1) -> Iterator[Outcome]:
        """Return what a function makes of tasks, in their order."""
        if self._ended or getattr(self._own, 'busy', False):
            return iter([function(*one) for one in zip(*tasks, strict=False)])
        return super().map(function, *tasks, timeout=timeout, chunksize=chunksize)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the threads."""
        self._ended = True
        super().shutdown(wait, cancel_futures=cancel_futures)


@contextmanager
def threads(jobs: int) -> Iterator[Threads]:
    """Give threads that keep the memory they free, with one in each for linear algebra."""
    with one_thread(), kept_memory(), Threads(jobs) as pool:
        yield pool
