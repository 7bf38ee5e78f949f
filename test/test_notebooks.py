# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The notebooks run from top to bottom, in a kernel of this interpreter."""

from __future__ import annotations

import os
from pathlib import Path
import sys
from typing import Any

from jupyter_client.manager import KernelManager
from nbclient import NotebookClient
import nbformat
import pytest

ROOT = Path(__file__).resolve().parent.parent
NOTEBOOKS = sorted((ROOT / 'examples' / 'notebooks').glob('*.ipynb'))
#: For a cell, on a machine with other work to do [s].
PATIENCE = 300


def test_each_has_a_row_on_its_page() -> None:
    assert len(NOTEBOOKS) == 6
    page = (ROOT / 'docs' / 'notebooks.md').read_text(encoding='utf-8')
    assert all(path.name in page for path in NOTEBOOKS)


def executed(path: Path, folder: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return a notebook with its outputs, run in a folder."""
    monkeypatch.setenv('PYTHONPATH', f'{ROOT}{os.pathsep}{os.environ.get("PYTHONPATH", "")}')
    monkeypatch.setenv('OMP_NUM_THREADS', '1')
    notebook = nbformat.read(path, as_version=4)  # type: ignore[no-untyped-call]
    # Not the kernel of that name that some other environment may have installed.
    manager = KernelManager(kernel_name='python3')
    manager.kernel_spec.argv[0] = sys.executable  # type: ignore[union-attr]
    try:
        NotebookClient(notebook, km=manager, timeout=PATIENCE,
                       resources={'metadata': {'path': str(folder)}}).execute()
    finally:
        manager.shutdown_kernel(now=True)
    return notebook


@pytest.mark.parametrize('path', NOTEBOOKS[1:], ids=lambda path: path.stem)
def test_notebook_runs_and_shows_results(
        path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    notebook = executed(path, tmp_path, monkeypatch)
    shown = [output for cell in notebook.cells if cell.cell_type == 'code'
             for output in cell.outputs if output.output_type in ('execute_result',
                                                                  'display_data')]
    assert len(shown) >= 4


def test_ten_lines_lead_from_a_bag_to_a_named_effect(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    notebook = executed(NOTEBOOKS[0], tmp_path, monkeypatch)
    cells = [cell for cell in notebook.cells if cell.cell_type == 'code']
    lines = [line for cell in cells for line in cell.source.splitlines() if line.strip()]
    assert len(lines) <= 10
    html = [output.data.get('text/html', '') for cell in cells for output in cell.outputs
            if output.output_type == 'execute_result']
    assert any('Enough for a diagnosis' in one for one in html)
    named = 'Missing effect found: dry friction in the drivetrain, left side'
    assert any(named in one for one in html)
    assert any('image/png' in output.get('data', {}) for output in cells[3].outputs)
    page = (tmp_path / 'found' / 'report.html').read_text(encoding='utf-8')
    assert 'What to change' in page


@pytest.mark.parametrize('path', NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_are_kept_without_outputs(path: Path) -> None:
    """Outputs are made by whoever runs them; kept ones go stale."""
    notebook = nbformat.read(path, as_version=4)  # type: ignore[no-untyped-call]
    for cell in notebook.cells:
        assert not cell.get('outputs')
        assert cell.get('execution_count') is None
