# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Run independent tasks here, on several processes, or on a Dask cluster; same results."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import as_completed
import os
import sys
from typing import Any, TypeVar

from lg_husky_sim.errors import FitError, MissingExtraError
from lg_husky_sim.processes import processes

Task = TypeVar('Task')
Outcome = TypeVar('Outcome')
#: Seconds to wait for a scheduler to answer.
PATIENCE = 10.0
#: Environment variable: who takes the tasks where no scheduler is given.
BACKEND = 'LG_HUSKY_BACKEND'


def run_tasks(function: Callable[[Task], Outcome], tasks: Sequence[Task], jobs: int = 1,
              scheduler: str | None = None, progress: Callable[[], None] | None = None
              ) -> list[Outcome]:
    """
    Apply a function to tasks.

    Parameters
    ----------
    function : callable
        Of one task; importable by name, and it depends on its task alone.
    tasks : sequence
        Picklable where ``jobs`` is above 1 or a scheduler is given.
    jobs : int
        Processes on this machine.
    scheduler : str, optional
        Address of a Dask scheduler, such as ``tcp://10.0.0.1:8786``; takes the tasks instead.
        Without one, ``LG_HUSKY_BACKEND`` may hold it, as ``dask:ADDRESS``.
    progress : callable, optional
        Called after each task.

    Returns
    -------
    list
        In the order of the tasks, whatever order they ended in.

    Raises
    ------
    FitError
        If the scheduler does not answer, or LG_HUSKY_BACKEND cannot be understood.
    MissingExtraError
        If a scheduler is given and Dask is not installed.
    """
    tell = progress or (lambda: None)
    scheduler = scheduler or _scheduler_of_environment()
    if scheduler is not None:
        return _dask(function, tasks, scheduler, tell)
    if jobs <= 1 or len(tasks) <= 1:
        done = []
        for task in tasks:
            done.append(function(task))
            tell()
        return done
    with processes(min(jobs, len(tasks))) as pool:
        futures = [pool.submit(function, task) for task in tasks]
        for future in as_completed(futures):
            future.result()
            tell()
        return [future.result() for future in futures]


def _scheduler_of_environment() -> str | None:
    text = os.environ.get(BACKEND, '') or 'processes'
    name, _, address = text.partition(':')
    if text == 'processes':
        return None
    if name != 'dask' or not address:
        raise FitError(f'{BACKEND} = {text!r} is not allowed: processes, or dask:ADDRESS such as '
                       'dask:tcp://10.0.0.1:8786')
    # A task that runs on the cluster does not hand its own tasks to it again.
    return None if _on_a_worker() else address


def _on_a_worker() -> bool:
    dask: Any = sys.modules.get('distributed')
    if dask is None:
        return False
    try:
        dask.get_worker()
    except ValueError:
        return False
    return True


def _dask(function: Callable[[Task], Outcome], tasks: Sequence[Task], scheduler: str,
          tell: Callable[[], None]) -> list[Outcome]:
    try:
        import distributed
    except ImportError as error:
        raise MissingExtraError('--scheduler needs Dask: pip install "lg_husky_sim[scale]"'
                                ) from error
    try:
        dask: Any = distributed
        client = dask.Client(scheduler, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        raise FitError(f'no Dask scheduler answers at {scheduler!r}') from error
    with client:
        futures = client.map(function, tasks, pure=False)
        for _ in dask.as_completed(futures, loop=client.loop):
            tell()
        results: list[Outcome] = client.gather(futures)
        return results
