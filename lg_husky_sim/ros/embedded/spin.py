# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The one spin loop: a wait set over read conditions, and timers."""

from __future__ import annotations

import time

from cyclonedds.core import WaitSet
from lg_husky_sim.ros.embedded.context import default_context, ExternalShutdownException
from lg_husky_sim.ros.embedded.node import Node

#: Longest uninterrupted wait [ns]: signals are only seen between waits.
SLICE = 50_000_000


class SingleThreadedExecutor:
    """Serves the callbacks of its nodes, in one thread and in order of creation."""

    def __init__(self) -> None:
        """Start without nodes."""
        self._context = default_context()
        self._nodes: list[Node] = []
        self._waitset: WaitSet | None = None
        self._seen: tuple[int, ...] = ()
        self._attached: list[object] = []

    def add_node(self, node: Node) -> None:
        """Serve a node from now on."""
        self._nodes.append(node)

    def remove_node(self, node: Node) -> None:
        """Serve a node no more."""
        self._nodes.remove(node)

    def shutdown(self) -> None:
        """Let go of the nodes."""
        self._nodes.clear()
        self._waitset = None
        self._attached.clear()

    def _current(self) -> WaitSet:
        # By the node as well: one that is exchanged for another may have come as far.
        seen = tuple(part for node in self._nodes for part in (id(node), node.version))
        if self._waitset is None or seen != self._seen:
            waitset = WaitSet(self._context.participant)
            waitset.attach(self._context.guard)
            conditions = [entity.condition for node in self._nodes for entity in node.waitables()]
            for condition in conditions:
                waitset.attach(condition)
            self._waitset, self._seen, self._attached = waitset, seen, [*conditions]
        return self._waitset

    def _serve(self, *, messages: bool) -> int:
        count = 0
        for node in self._nodes:
            if messages:
                count += sum(entity.serve() for entity in node.waitables())
            count += sum(timer.serve() for timer in node.timers())
        return count

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """
        Serve what is ready, or wait for it.

        Parameters
        ----------
        timeout_sec : float, optional
            Longest wait [s]; without limit if not given.

        Raises
        ------
        ExternalShutdownException
            If the context is shut down.

        """
        end = None if timeout_sec is None else time.monotonic_ns() + int(timeout_sec * 1e9)
        arrived = True
        while True:
            if not self._context.running:
                raise ExternalShutdownException
            if self._serve(messages=arrived):
                return
            now = time.monotonic_ns()
            if end is not None and now >= end:
                return
            due = [timer.due for node in self._nodes for timer in node.timers()
                   if not timer.is_canceled()]
            limits = [now + SLICE, *due] + ([end] if end is not None else [])
            arrived = self._current().wait(max(0, min(limits) - now)) > 0

    def spin(self) -> None:
        """Serve until the context is shut down, which raises ExternalShutdownException."""
        while True:
            self.spin_once()


def spin(node: Node) -> None:
    """Serve a node until the context is shut down, which raises ExternalShutdownException."""
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        executor.spin()
    finally:
        executor.shutdown()


def spin_once(node: Node, *, timeout_sec: float | None = None) -> None:
    """Serve a node once, waiting for at most ``timeout_sec`` [s]."""
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        executor.spin_once(timeout_sec)
    finally:
        executor.shutdown()
