# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Who does the independent work of a search: threads here, or a Dask cluster."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

from lg_husky_sim.identification.executor import run_tasks

Task = TypeVar('Task')
Outcome = TypeVar('Outcome')


@dataclass(frozen=True)
class Workers:
    """
    Where tasks run.

    Parameters
    ----------
    jobs : int
        Threads of this process; the kernel runs without the interpreter's lock.
    scheduler : str or None
        Address of a Dask scheduler that takes the tasks instead.
    """

    jobs: int = 1
    scheduler: str | None = None

    def map(self, function: Callable[[Task], Outcome],  # noqa: A003
            tasks: Sequence[Task]) -> list[Outcome]:
        """
        Apply a function to tasks.

        Parameters
        ----------
        function : callable
            Importable by name; it depends on its task alone.
        tasks : sequence

        Returns
        -------
        list
            In the order of the tasks.

        Raises
        ------
        FitError
            If the scheduler does not answer.
        """
        if self.scheduler is not None:
            return run_tasks(function, tasks, scheduler=self.scheduler)
        with ThreadPoolExecutor(self.jobs) as pool:
            return list(pool.map(function, tasks))


#: One thread of this process.
HERE = Workers()
