# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Who does the independent work of a search: processes here, or a Dask cluster."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import AbstractContextManager, ExitStack
from types import TracebackType
from typing import TypeVar

from lg_husky_sim.identification.executor import processes, run_tasks

Task = TypeVar('Task')
Outcome = TypeVar('Outcome')


class Workers(AbstractContextManager['Workers']):
    """
    Where tasks run.

    Processes, not threads: only a seventh of a refit runs without the interpreter's lock. They
    begin with the ``with`` block and end with it; outside of one everything runs in this process.

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
        self._ends = ExitStack()

    def __enter__(self) -> Workers:
        """Start the processes."""
        if self.jobs > 1 and self.scheduler is None:
            # They load while the first process still reads and recalibrates.
            self._pool = self._ends.enter_context(
                processes(self.jobs, 'lg_husky_sim.diagnosis.refits'))
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 traceback: TracebackType | None) -> None:
        """End them; what they still do is of no use to anyone."""
        self._pool = None
        self._ends.__exit__(kind, error, traceback)

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
