# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Compile the kernel in a process of its own, while this one already steps in plain Python.

Both give the same numbers, bit for bit, so that nothing tells when the machine code takes over.
"""

from __future__ import annotations

from collections.abc import Callable
import math
import os
import threading
import time

from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.jit import Kernel
from lg_husky_sim.signals import BodyTwist
from lg_husky_sim.simulation.event_kernel import follow
from lg_husky_sim.simulation.simulator import Simulator


def make_ready(step: Callable[[], object], longest: float) -> bool:
    """
    Make ready for stepping.

    Machine code that is on disk is loaded. Where there is none, it is compiled meanwhile.

    Parameters
    ----------
    step : callable
        Makes a step of a simulation that nobody else needs.
    longest : float
        What a step may take of the processor in plain Python [s]; a plant that takes longer
        waits until the kernel is compiled.

    Returns
    -------
    bool
        Whether steps are made in plain Python for now.

    """
    if not isinstance(follow, Kernel):
        step()
        return False
    # Who steps with a clock must not be stopped in between.
    follow.patience = math.inf
    ready = follow.soon()
    step()
    if ready.is_set():
        return False
    began = time.thread_time()
    step()
    if time.thread_time() - began > longest:
        ready.wait()
        step()
    return not ready.is_set()


def _end_with_parent() -> None:
    # By its number: a stream's lock would be held when the interpreter ends.
    while os.read(0, 1):
        pass
    os._exit(1)


def compile_here() -> None:
    """Compile unless that was done before, and leave the machine code on disk."""
    if isinstance(follow, Kernel):
        follow.at_once()
    model = load_model()
    simulator = Simulator(compile_model(model.structure).at(model.parameters), 0.02)
    simulator.step(simulator.initial(), BodyTwist())


if __name__ == '__main__':
    threading.Thread(target=_end_with_parent, daemon=True).start()
    compile_here()
