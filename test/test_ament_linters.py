# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Jazzy's own linters, where ROS is; elsewhere ./check applies the same rules by itself."""

from __future__ import annotations

from pathlib import Path
import re
import subprocess
import sys

import pytest

ROOT = Path(__file__).resolve().parent.parent
PLACES = [str(ROOT / name) for name in ('lg_husky_sim', 'test', 'launch', 'scripts', 'setup.py')]
WHERE = 'is part of ROS 2; ./check applies its rules without it'
#: Functions and a class whose docstrings break as many rules as fit here.
FAULTY = '''"""A module."""


def no_full_stop():
    """Return nothing"""


def no_order():
    """Returns nothing."""


def no_blank_line():
    """
    Return.
    Nothing.
    """


def blank_line():
    """Return."""

    return 1


def spaces():
    """ Return. """


class Sections:
    """
    Hold.

    returns
    ---
    Nothing.
    """

    def method(self):
        """
        Return

      less.
        """


def signed(a):
    """signed(a) -> a."""


def escaped():
    """Return a \\\\d."""


def other_quotes():
    """"Return." """
'''


def test_ament_flake8_finds_nothing() -> None:
    main = pytest.importorskip('ament_flake8.main', reason=f'ament_flake8 {WHERE}')
    code, errors = main.main_with_errors(argv=PLACES)
    assert code == 0, '\n'.join(errors)


def test_ament_pep257_finds_nothing() -> None:
    main = pytest.importorskip('ament_pep257.main', reason=f'ament_pep257 {WHERE}')
    assert main.main(argv=PLACES) == 0


def test_flake8_finds_in_docstrings_what_pydocstyle_finds(tmp_path: Path) -> None:
    """So ./check need not have every docstring read twice."""
    for tool in ('flake8', 'flake8_docstrings', 'pydocstyle'):
        pytest.importorskip(tool)
    faulty = tmp_path / 'faulty.py'
    faulty.write_text(FAULTY, encoding='utf-8')

    def found(tool: str) -> set[str]:
        said = subprocess.run(
            [sys.executable, '-m', tool, '--config', str(ROOT / 'setup.cfg'), str(faulty)],
            capture_output=True, text=True, check=False).stdout
        return set(re.findall(r'\b(D\d{3})\b', said))
    assert len(found('pydocstyle')) > 8
    assert found('flake8') == found('pydocstyle')
