# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Threads whose tasks have tasks of their own."""

from __future__ import annotations

import threading

from lg_husky_sim.threads import Threads
import pytest


@pytest.mark.parametrize('jobs', [0, 1, 3])
def test_a_task_may_have_tasks_of_its_own(jobs: int) -> None:
    """They would wait for ever for a thread of those that wait for them."""
    pool = Threads(jobs)
    try:
        found = list(pool.map(lambda a: list(pool.map(lambda b: (a, b), range(3))), range(4),
                              timeout=20.0))
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
    assert found == [[(a, b) for b in range(3)] for a in range(4)]


def test_tasks_run_beside_each_other() -> None:
    both = threading.Barrier(2, timeout=10.0)
    with Threads(2) as pool:
        assert sorted(pool.map(lambda _: both.wait(), range(2))) == [0, 1]
        # Those of a task run in its own thread, one after the other.
        names = list(pool.map(lambda _: set(pool.map(
            lambda _: threading.current_thread().name, range(5))), range(2)))
    assert all(len(one) == 1 for one in names)


def test_tasks_that_come_after_the_end_run_where_they_are_asked_for() -> None:
    """A report is made of what was found when the threads are gone."""
    with Threads(2) as pool:
        pass
    names = set(pool.map(lambda _: threading.current_thread().name, range(3)))
    assert names == {threading.current_thread().name}
