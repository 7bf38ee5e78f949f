# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Machine code on disk must not outlive the sources that it was made from."""

from __future__ import annotations

import os
from pathlib import Path
import subprocess
import sys

from lg_husky_sim.jit import compiled
import pytest

pytestmark = pytest.mark.skipif(not compiled(), reason='numba is not used here')

INNER = """from lg_husky_sim.jit import jit


@jit
def inner(x):
    return x + {number}
"""
OUTER = """from lg_husky_sim.jit import jit
from inner_part import inner


@jit
def outer(x):
    return inner(x)


print(outer(1.0))
"""


def _run(folder: Path) -> float:
    return float(subprocess.run(
        [sys.executable, str(folder / 'main_part.py')], check=True, capture_output=True, text=True,
        env={**os.environ, 'PYTHONPATH': os.pathsep.join([
            str(folder), str(Path(__file__).parents[1])])}).stdout)


def test_a_changed_callee_is_compiled_anew(tmp_path: Path) -> None:
    (tmp_path / 'main_part.py').write_text('import outer_part  # noqa: F401\n')
    (tmp_path / 'outer_part.py').write_text(OUTER)
    (tmp_path / 'inner_part.py').write_text(INNER.format(number=1.0))
    assert _run(tmp_path) == 2.0
    assert _run(tmp_path) == 2.0
    assert list(tmp_path.rglob('*.nbi')), 'nothing was cached, so this test shows nothing'
    (tmp_path / 'inner_part.py').write_text(INNER.format(number=10.0))
    assert _run(tmp_path) == 11.0


def test_code_of_another_python_or_for_an_older_numba_is_not_ours(tmp_path: Path) -> None:
    """A node took 72 s to start: it took them for its own, and then compiled while it waited."""
    source = tmp_path / 'inner_part.py'
    source.write_text(INNER.format(number=1.0))
    os.utime(source, (1.0, 1.0))
    (tmp_path / 'main_part.py').write_text('from inner_part import inner\nprint(inner(1.0))\n')
    assert _run(tmp_path) == 2.0
    (tmp_path / 'main_part.py').write_text(
        'from inner_part import inner\nprint(float(inner.on_disk()))\n')
    assert _run(tmp_path) == 1.0
    (index,) = tmp_path.rglob('*.nbi')
    other = index.with_name(f'{index.name.rpartition(".py")[0]}.py399.nbi')
    index.rename(other)
    assert _run(tmp_path) == 0.0
    other.rename(index)
    assert _run(tmp_path) == 1.0
    os.utime(index, (2.0, 2.0))
    assert _run(tmp_path) == 0.0
