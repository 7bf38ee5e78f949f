# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Compile the kernel in a process of its own, while this one already steps in plain Python.

Both give the same numbers, bit for bit, so that nothing tells when the machine code takes over.
"""

from __future__ import annotations

from collections.abc import Callable
import os
import subprocess
import sys
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
    if not isinstance(follow, Kernel) or follow.on_disk():
        step()
        return False
    done = follow.soon(_compile_elsewhere)
    step()
    began = time.thread_time()
    step()
    if time.thread_time() - began > longest:
        done.wait()
        step()
    return not done.is_set()


def _compile_elsewhere() -> None:
    # It ends with this process, too: its standard input then does.
    with subprocess.Popen([sys.executable, '-m', 'lg_husky_sim.simulation.compiling'],
                          stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
                          stderr=subprocess.DEVNULL) as process:
        process.wait()


def _end_with_parent() -> None:
    # By its number: a stream's lock would be held when the interpreter ends.
    while os.read(0, 1):
        pass
    os._exit(1)


def main() -> None:
    """Compile, and leave the machine code on disk."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    model = load_model()
    simulator = Simulator(compile_model(model.structure).at(model.parameters), 0.02)
    simulator.step(simulator.initial(), BodyTwist())


if __name__ == '__main__':
    main()
