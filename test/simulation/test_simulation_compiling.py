# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A simulation runs in plain Python while its kernel is compiled elsewhere."""

from __future__ import annotations

import os
from pathlib import Path
import signal
import subprocess
import sys
import threading
import time

from lg_husky_sim import jit as jit_module
from lg_husky_sim.jit import compiled, jit, jit_part, Kernel
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation import compiling
import numpy as np
import pytest

#: Simulates, and says whether the compiler is at work and how much it has made here.
SCRIPT = """
from lg_husky_sim import Husky
from lg_husky_sim.simulation.event_kernel import follow
Husky().simulate('spin')
print(not follow.soon().is_set(), len(follow._made().signatures))
"""

pytestmark = pytest.mark.skipif(not compiled(), reason='numba is not used here')


@jit_part
def _third(x: float) -> float:
    return x / 3.0


@jit
def _series(x: float, count: int) -> float:
    total = 0.0
    for i in range(count):
        total += _third(x) / (i + 1)
    return total


def fresh(compiler: str = 'somebody') -> Kernel:
    """Return a kernel that nothing was called of, without machine code on disk."""
    assert isinstance(_series, Kernel)
    return Kernel(_series.plain, compiler)


@pytest.fixture
def gate(monkeypatch: pytest.MonkeyPatch) -> threading.Event:
    """Return what somebody who compiles elsewhere waits for; nothing is on disk until then."""
    gate = threading.Event()
    monkeypatch.setattr(Kernel, 'on_disk', lambda _: False)
    monkeypatch.setattr(jit_module, 'compile_elsewhere', lambda _: gate.wait(60.0))
    return gate


def never(x: float, count: int) -> float:
    raise AssertionError('plain Python was called')


def test_machine_code_and_plain_python_give_the_same_bits() -> None:
    kernel = fresh('')
    assert kernel(0.7, 1000) == kernel.plain(0.7, 1000)


def test_calls_are_answered_before_the_machine_code_is_there(gate: threading.Event) -> None:
    kernel = fresh()
    expected = kernel.plain(0.7, 100)
    assert kernel(0.7, 100) == expected
    ready = kernel.soon()
    assert not ready.is_set()
    gate.set()
    assert ready.wait(60.0)
    kernel.plain = never
    assert kernel(0.7, 100) == expected


def test_what_could_not_be_compiled_elsewhere_is_compiled_here(
        monkeypatch: pytest.MonkeyPatch) -> None:
    """Without machine code on disk the thread makes it."""
    monkeypatch.setattr(Kernel, 'on_disk', lambda _: False)
    monkeypatch.setattr(jit_module, 'compile_elsewhere', lambda _: time.sleep(0.2))
    kernel = fresh()
    expected = kernel(0.7, 3)
    assert kernel.soon().wait(60.0)
    kernel.plain = never
    assert kernel(0.7, 3) == expected


def test_who_has_called_for_long_waits(gate: threading.Event) -> None:
    """It is not worth while to do a long computation in plain Python."""
    kernel = fresh()
    expected = kernel(0.7, 3)
    assert kernel.patience < jit_module.PATIENCE
    kernel._made()
    kernel.patience, kernel.plain = 0.0, never
    threading.Timer(0.2, gate.set).start()
    assert kernel(0.7, 3) == expected
    assert gate.is_set()


def test_who_waits_is_stopped_with_the_compiler_and_later_calls_begin_anew(
        monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C reaches both; nothing is compiled here then, for as long as that takes."""
    monkeypatch.setattr(Kernel, 'on_disk', lambda _: False)
    ends, stop = iter([-signal.SIGINT, 0]), threading.Event()
    monkeypatch.setattr(jit_module, 'compile_elsewhere', lambda _: stop.wait(60.0) and next(ends))
    kernel = fresh()
    kernel.patience = 0.0
    threading.Timer(0.2, stop.set).start()
    with pytest.raises(KeyboardInterrupt):
        kernel(0.7, 3)
    assert kernel(0.7, 3) == kernel.plain(0.7, 3)
    assert kernel.soon().wait(60.0)
    assert next(ends, None) is None


def test_somebody_who_compiles_waits_for_it() -> None:
    kernel = fresh()
    kernel.at_once()
    kernel._made()
    expected, kernel.plain = kernel.plain(0.7, 3), never
    assert kernel(0.7, 3) == expected


def test_machine_code_on_disk_is_loaded_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    fresh('')(0.7, 3)
    monkeypatch.setattr(jit_module, 'compile_elsewhere', never)
    kernel = fresh()
    assert kernel.soon().is_set()
    expected, kernel.plain = kernel.plain(0.7, 3), never
    assert kernel(0.7, 3) == expected


@jit
def _filled(values: FloatArray) -> float:
    values[0] = 2.0
    return float(values[0])


def test_arrays_that_become_read_only_after_their_call_are_no_other_type(
        gate: threading.Event) -> None:
    assert isinstance(_filled, Kernel)
    kernel, values = Kernel(_filled.plain, 'somebody'), np.zeros(3)
    assert kernel(values) == 2.0
    values.setflags(write=False)
    gate.set()
    assert kernel.soon().wait(60.0)
    kernel.plain = never
    assert len(kernel._made().signatures) == 1
    assert kernel(np.zeros(3)) == 2.0


@pytest.mark.parametrize(('longest', 'waits'), [(10.0, False), (0.0, True)])
def test_only_a_step_that_is_slow_waits(monkeypatch: pytest.MonkeyPatch, gate: threading.Event,
                                        longest: float, waits: bool) -> None:
    kernel, steps = fresh(), []

    def step() -> None:
        steps.append(kernel(0.7, 1000))
        if len(steps) == 2:
            threading.Timer(0.2, gate.set).start()

    monkeypatch.setattr(compiling, 'follow', kernel)
    assert compiling.make_ready(step, longest) is not waits
    assert gate.wait(60.0)
    assert len(set(steps)) == 1


def test_who_steps_with_a_clock_is_never_stopped(monkeypatch: pytest.MonkeyPatch,
                                                 gate: threading.Event) -> None:
    kernel = fresh()
    kernel.patience = 0.0
    monkeypatch.setattr(compiling, 'follow', kernel)
    assert compiling.make_ready(lambda: kernel(0.7, 3), 10.0)
    assert kernel(0.7, 3) == kernel.plain(0.7, 3)
    assert not kernel.soon().is_set()
    gate.set()


def test_a_first_simulation_does_not_wait_for_the_compiler(tmp_path: Path) -> None:
    """A program that simulates a little ends long before the machine code is there."""
    found = subprocess.run(
        [sys.executable, '-c', SCRIPT], check=True, capture_output=True, text=True,
        env={**os.environ, 'NUMBA_CACHE_DIR': str(tmp_path),
             'PYTHONPATH': str(Path(__file__).parents[2])}).stdout.split()
    assert found == ['True', '0']
