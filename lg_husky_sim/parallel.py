# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Run independent tasks here, on several processes, or on a cluster; the same results."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import resource_tracker
import os
import signal
import socket
import sys
import threading
import time
from typing import Any, TypeVar

from lg_husky_sim.errors import BackendError
from lg_husky_sim.extras import require

Task = TypeVar('Task')
Outcome = TypeVar('Outcome')
#: Seconds to wait for a scheduler to answer.
PATIENCE = 10.0
#: Seconds between two looks of a worker at whether the one who asked is still there.
LOOK = 0.5
#: Environment variable: who takes the tasks where no scheduler is given.
BACKEND = 'LG_HUSKY_BACKEND'


def map_tasks(function: Callable[[Task], Outcome], tasks: Sequence[Task], jobs: int = 1,
              scheduler: str | None = None, threads: bool = False) -> Iterator[Outcome]:
    """
    Apply a function to tasks; yield what comes out, in the order of the tasks.

    Parameters
    ----------
    function : callable
        Of one task; importable by name, and it depends on its task alone.
    tasks : sequence
        Picklable where they leave this process.
    jobs : int
        Processes on this machine.
    scheduler : str, optional
        Address of a Dask scheduler, such as ``tcp://10.0.0.1:8786``; takes the tasks instead.
        Without one, ``LG_HUSKY_BACKEND`` may name a cluster, as ``dask:ADDRESS`` or
        ``ray:ADDRESS``.
    threads : bool
        Threads in place of processes on this machine: for tasks that wait for others.

    Yields
    ------
    object
        An outcome; tasks that come after it are worked at meanwhile.

    Raises
    ------
    BackendError
        If the cluster does not answer, a worker is lost whose task nobody takes over, or
        LG_HUSKY_BACKEND cannot be understood.
    MissingExtraError
        If a cluster is named and Dask or Ray is not installed.

    """
    name, address = ('dask', scheduler) if scheduler is not None else _backend_of_environment()
    if name == 'processes' and (jobs <= 1 or len(tasks) <= 1):
        yield from map(function, tasks)
        return
    with _workers(name, address, min(jobs, len(tasks)), threads) as parallel:
        try:
            from joblib import delayed
            with _deaf_to_interrupts():
                found = parallel(delayed(function)(task) for task in tasks)
            yield from found
        except BrokenProcessPool as error:
            raise BackendError('a worker process was killed, perhaps because memory ran out: try '
                               f'fewer than {jobs} jobs') from error


def run_tasks(function: Callable[[Task], Outcome], tasks: Sequence[Task], jobs: int = 1,
              scheduler: str | None = None, progress: Callable[[], None] | None = None
              ) -> list[Outcome]:
    """
    Apply a function to tasks, as `map_tasks` does; return what comes out.

    Parameters
    ----------
    function, tasks, jobs, scheduler
        See `map_tasks`.
    progress : callable, optional
        Called after each task.

    Returns
    -------
    list
        In the order of the tasks.

    """
    done = []
    for outcome in map_tasks(function, tasks, jobs, scheduler):
        done.append(outcome)
        if progress is not None:
            progress()
    return done


def _begin(parent: int) -> None:
    # In a new worker. Ctrl-C ends it without a word, also where the one who asked is between two
    # outcomes: at its exit, it waits for workers that go on.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    if hasattr(signal, 'pthread_sigmask'):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})

    # Loky's would go on with its task and then wait for others for minutes, should the one who
    # asked be killed.
    def follow() -> None:
        while os.getppid() == parent:
            time.sleep(LOOK)
        os._exit(1)
    threading.Thread(target=follow, daemon=True).start()


@contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """Workers are born deaf to Ctrl-C, until they can end without a traceback."""
    if not hasattr(signal, 'pthread_sigmask'):  # Windows
        yield
        return
    # Else its start, which comes with that of the first worker, would take the mask away.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _backend_of_environment() -> tuple[str, str]:
    text = os.environ.get(BACKEND, '') or 'processes'
    name, _, address = text.partition(':')
    if text != 'processes' and (name not in {'dask', 'ray'} or not address):
        raise BackendError(f'{BACKEND} = {text!r} is not allowed: processes, dask:ADDRESS such '
                           'as dask:tcp://10.0.0.1:8786, or ray:ADDRESS')
    # A task that runs on the cluster does not hand its own tasks to it again.
    return ('processes', '') if _on_a_worker() else (name, address)


def _on_a_worker() -> bool:
    dask: Any = sys.modules.get('distributed')
    if dask is None:
        return False
    try:
        dask.get_worker()
    except ValueError:
        return False
    return True


@contextmanager
def _workers(name: str, address: str, jobs: int, threads: bool) -> Iterator[Any]:
    """Yield a `joblib.Parallel` of those who take the tasks."""
    from joblib import Parallel, parallel_config

    # One task at a time: a lost worker costs only its share.
    options: dict[str, Any] = {'return_as': 'generator', 'batch_size': 1}
    if name == 'dask':
        client = _dask_client(address)
        with client:
            with parallel_config(backend='dask', client=client):
                parallel = Parallel(-1, **options)
            yield parallel
    elif name == 'ray':
        _join_ray(address)
        with parallel_config(backend='ray'):
            yield Parallel(-1, **{**options, 'return_as': 'list'})  # all that Ray's backend knows
    elif threads:
        yield Parallel(jobs, 'threading', **options)
    else:
        yield Parallel(jobs, 'loky', initializer=_begin, initargs=(os.getpid(),), **options)


def _dask_client(address: str) -> Any:
    require('distributed', 'use a Dask cluster')
    import distributed
    dask: Any = distributed
    try:
        return dask.Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        raise BackendError(f'no Dask scheduler answers at {address!r}') from error


def _join_ray(address: str) -> None:
    require('ray', 'use a Ray cluster')
    host, _, port = address.rpartition('/')[2].rpartition(':')
    try:
        # Ray itself would look for minutes for a cluster that is not there.
        socket.create_connection((host, int(port)), PATIENCE).close()
    except (OSError, ValueError) as error:
        raise BackendError(f'no Ray cluster answers at {address!r}') from error
    import ray
    from ray.util.joblib import register_ray
    ray.init(address, ignore_reinit_error=True, log_to_driver=False)
    register_ray()
