# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Who does the independent work of a search: processes here, or a Dask cluster."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import AbstractContextManager
import multiprocessing
import signal
from types import TracebackType
from typing import TypeVar

from lg_husky_sim.identification.executor import run_tasks

Task = TypeVar('Task')
Outcome = TypeVar('Outcome')


def _begin() -> None:
    # In a new process. Ctrl-C is for the one who asked; he ends the others.
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _load(_: int) -> None:
    # Import what most tasks need, while the first process still reads and recalibrates.
    from lg_husky_sim.diagnosis import refits  # noqa: F401


class Workers(AbstractContextManager['Workers']):
    """
    Where tasks run.

    Processes, not threads: only a seventh of a refit runs without the interpreter's lock. They
    begin with the ``with`` block and end with it.

    Parameters
    ----------
    jobs : int
        Processes on this machine; 1 does everything in this one.
    scheduler : str, optional
        Address of a Dask scheduler that takes the tasks instead.
    """

    def __init__(self, jobs: int = 1, scheduler: str | None = None) -> None:
        """Start nothing yet."""
        self.jobs, self.scheduler = jobs, scheduler
        self._pool: ProcessPoolExecutor | None = None

    def __enter__(self) -> Workers:
        """Start the processes."""
        if self.jobs > 1 and self.scheduler is None:
            # Spawned: nothing of this process's threads and state is copied.
            self._pool = ProcessPoolExecutor(
                self.jobs, mp_context=multiprocessing.get_context('spawn'), initializer=_begin)
            for number in range(self.jobs):
                self._pool.submit(_load, number)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 traceback: TracebackType | None) -> None:
        """End them; what they still do is of no use to anyone."""
        if self._pool is not None:
            pool, self._pool = self._pool, None
            pool.shutdown(wait=kind is None, cancel_futures=True)

    def map(self, function: Callable[[Task], Outcome],  # noqa: A003
            tasks: Sequence[Task]) -> list[Outcome]:
        """
        Apply a function to tasks.

        Parameters
        ----------
        function : callable
            Importable by name; it depends on its task alone.
        tasks : sequence
            Picklable where they go to other processes.

        Returns
        -------
        list
            In the order of the tasks; the same wherever they run.

        Raises
        ------
        FitError
            If the scheduler does not answer.
        """
        if self.scheduler is not None:
            return run_tasks(function, tasks, scheduler=self.scheduler)
        if self._pool is None or len(tasks) < 2:
            return [function(task) for task in tasks]
        # What several tasks share travels once with each chunk of them.
        chunk = max(1, len(tasks) // (4 * self.jobs))
        return list(self._pool.map(function, tasks, chunksize=chunk))


#: Everything in this process.
HERE = Workers()
