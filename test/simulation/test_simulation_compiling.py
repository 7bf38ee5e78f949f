# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A simulation runs in plain Python while its kernel is compiled elsewhere."""

from __future__ import annotations

import threading
import time

from lg_husky_sim.jit import compiled, jit, jit_part, Kernel
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation import compiling
import numpy as np
import pytest

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


def fresh() -> Kernel:
    """Return a kernel that nothing was called of."""
    assert isinstance(_series, Kernel)
    return Kernel(_series.plain)


def never(x: float, count: int) -> float:
    raise AssertionError('plain Python was called')


def test_machine_code_and_plain_python_give_the_same_bits() -> None:
    kernel = fresh()
    assert kernel(0.7, 1000) == kernel.plain(0.7, 1000)


def test_calls_are_answered_before_the_machine_code_is_there() -> None:
    kernel, gate = fresh(), threading.Event()
    done = kernel.soon(gate.wait)
    expected = kernel.plain(0.7, 100)
    assert kernel(0.7, 100) == expected
    assert not done.is_set()
    gate.set()
    assert done.wait(60.0)
    kernel.plain = never
    assert kernel(0.7, 100) == expected


def test_what_could_not_be_compiled_elsewhere_is_compiled_here() -> None:
    """Without machine code on disk the thread makes it."""
    kernel = fresh()
    done = kernel.soon(lambda: time.sleep(0.2))
    expected = kernel(0.7, 3)
    assert done.wait(60.0)
    kernel.plain = never
    assert kernel(0.7, 3) == expected


@jit
def _filled(values: FloatArray) -> float:
    values[0] = 2.0
    return float(values[0])


def test_arrays_that_become_read_only_after_their_call_are_no_other_type() -> None:
    assert isinstance(_filled, Kernel)
    kernel, gate, values = Kernel(_filled.plain), threading.Event(), np.zeros(3)
    done = kernel.soon(gate.wait)
    assert kernel(values) == 2.0
    values.setflags(write=False)
    gate.set()
    assert done.wait(60.0)
    kernel.plain = never
    assert len(kernel._made().signatures) == 1
    assert kernel(np.zeros(3)) == 2.0


@pytest.mark.parametrize(('longest', 'waits'), [(10.0, False), (0.0, True)])
def test_only_a_step_that_is_slow_waits(monkeypatch: pytest.MonkeyPatch, longest: float,
                                        waits: bool) -> None:
    kernel, gate, steps = fresh(), threading.Event(), []

    def step() -> None:
        steps.append(kernel(0.7, 1000))
        if len(steps) == 2:
            threading.Timer(0.2, gate.set).start()

    monkeypatch.setattr(kernel, 'on_disk', lambda: False)
    monkeypatch.setattr(compiling, 'follow', kernel)
    monkeypatch.setattr(compiling, '_compile_elsewhere', gate.wait)
    assert compiling.make_ready(step, longest) is not waits
    assert gate.wait(60.0)
    assert len(set(steps)) == 1


def test_machine_code_on_disk_is_loaded_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    kernel, calls = fresh(), []
    kernel(0.7, 3)
    monkeypatch.setattr(compiling, 'follow', kernel)
    monkeypatch.setattr(compiling, '_compile_elsewhere', lambda: calls.append(1))
    assert not compiling.make_ready(lambda: kernel(0.7, 3), 0.0)
    assert not calls
