# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Fixtures for pytest: ``husky`` in lock step, ``live_husky`` as a real node."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from lg_husky_sim.testing.lockstep import LockStepHusky
import pytest


@pytest.fixture
def husky() -> Callable[..., LockStepHusky]:
    """
    Return a maker of simulated Huskies in the test's process.

    Its keywords are the node's parameters. A minute's drive takes milliseconds, and the same
    commands always give the same drive.
    """
    return LockStepHusky


@pytest.fixture
def live_husky() -> Iterator[Callable[..., Any]]:
    """
    Return a maker of live nodes, each in its own process, all in one private domain.

    Its keywords are the node's parameters; ``arguments`` holds more ROS arguments. What it
    returns has a ``probe`` to listen and talk with, and a ``node`` process. All nodes end with
    the test.
    """
    from lg_husky_sim.testing.live import LiveHusky, probed_domain
    # Here and once, before anybody waits: the kernel is compiled by it where that is new.
    LockStepHusky().step()
    made: list[LiveHusky] = []
    with probed_domain() as probe:
        def make(arguments: tuple[str, ...] = (), environment: dict[str, str] | None = None,
                 **parameters: object) -> LiveHusky:
            made.append(LiveHusky(probe, parameters, arguments, environment))
            return made[-1]
        try:
            yield make
        finally:
            for one in made:
                one.node.stop()
