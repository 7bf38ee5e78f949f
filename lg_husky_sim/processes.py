# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Processes that share work, and end with the one who asked, however that one ends."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from importlib import import_module
import multiprocessing
import os
import signal
import threading


def _begin(needed: str) -> None:
    # In a new process: should the one who asked be killed, it would wait for work for ever.
    parent = multiprocessing.parent_process()

    def follow() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)
    threading.Thread(target=follow, daemon=True).start()
    if needed:
        import_module(needed)


@contextmanager
def processes(jobs: int, needed: str = '') -> Iterator[ProcessPoolExecutor]:
    """
    Yield processes that take tasks; they end with the block, at once if it fails.

    Parameters
    ----------
    jobs : int
        How many.
    needed : str, optional
        Module that they import at once.

    Yields
    ------
    concurrent.futures.ProcessPoolExecutor
        Of spawned processes: nothing of this one's threads and state is copied.
    """
    others = multiprocessing.active_children()
    pool = ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context('spawn'),
                               initializer=_begin, initargs=(needed,))
    # Ctrl-C is for the one who asked, who ends the others: they are born deaf to it.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    for _ in range(jobs):
        pool.submit(os.getpid)
    signal.pthread_sigmask(signal.SIG_SETMASK, before)
    try:
        yield pool
    except BaseException:
        for child in multiprocessing.active_children():
            if child not in others:
                child.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)
