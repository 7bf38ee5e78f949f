# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The notebooks run from top to bottom, in a kernel of this interpreter."""

from __future__ import annotations

import os
from pathlib import Path
import sys

from jupyter_client.manager import KernelManager
from nbclient import NotebookClient
import nbformat
import pytest

ROOT = Path(__file__).resolve().parent.parent
NOTEBOOKS = sorted((ROOT / 'examples' / 'notebooks').glob('*.ipynb'))
#: For a cell, on a machine with other work to do [s].
PATIENCE = 300


def test_there_are_five() -> None:
    assert len(NOTEBOOKS) == 5
    page = (ROOT / 'docs' / 'notebooks.md').read_text(encoding='utf-8')
    assert all(path.name in page for path in NOTEBOOKS)


@pytest.mark.parametrize('path', NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_runs_and_shows_results(
        path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('PYTHONPATH', f'{ROOT}{os.pathsep}{os.environ.get("PYTHONPATH", "")}')
    monkeypatch.setenv('OMP_NUM_THREADS', '1')
    notebook = nbformat.read(path, as_version=4)  # type: ignore[no-untyped-call]
    # Not the kernel of that name that some other environment may have installed.
    manager = KernelManager(kernel_name='python3')
    manager.kernel_spec.argv[0] = sys.executable  # type: ignore[union-attr]
    try:
        NotebookClient(notebook, km=manager, timeout=PATIENCE,
                       resources={'metadata': {'path': str(tmp_path)}}).execute()
    finally:
        manager.shutdown_kernel(now=True)
    shown = [output for cell in notebook.cells if cell.cell_type == 'code'
             for output in cell.outputs if output.output_type in ('execute_result',
                                                                  'display_data')]
    assert len(shown) >= 4


@pytest.mark.parametrize('path', NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_are_kept_without_outputs(path: Path) -> None:
    """Outputs are made by whoever runs them; kept ones go stale."""
    notebook = nbformat.read(path, as_version=4)  # type: ignore[no-untyped-call]
    for cell in notebook.cells:
        assert not cell.get('outputs')
        assert cell.get('execution_count') is None
