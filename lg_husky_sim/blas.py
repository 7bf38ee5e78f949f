# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
One thread for each product of matrices, where many simulations run side by side.

Threads of linear algebra inside threads of simulations wait for each other: a diagnosis on two
cores took twice the processor time with them. They change the last bits of sums, too.
"""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
import importlib.util
import os

#: What libraries of linear algebra read when they are loaded.
VARIABLES = ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS')


def set_one_thread() -> None:
    """Let a process that has not loaded NumPy yet use one thread, unless its user chose."""
    for name in VARIABLES:
        os.environ.setdefault(name, '1')


def one_thread() -> AbstractContextManager[object]:
    """Return a context with one thread; without threadpoolctl, one that changes nothing."""
    if importlib.util.find_spec('threadpoolctl') is None:
        return nullcontext()
    from threadpoolctl import threadpool_limits
    limits: AbstractContextManager[object] = threadpool_limits(1)
    return limits
