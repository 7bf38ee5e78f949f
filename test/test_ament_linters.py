# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Jazzy's own linters, where ROS is; elsewhere ./check applies the same rules by itself."""

from __future__ import annotations

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PLACES = [str(ROOT / name) for name in ('lg_husky_sim', 'test', 'launch', 'scripts', 'setup.py')]
WHERE = 'is part of ROS 2; ./check applies its rules without it'


def test_ament_flake8_finds_nothing() -> None:
    main = pytest.importorskip('ament_flake8.main', reason=f'ament_flake8 {WHERE}')
    code, errors = main.main_with_errors(argv=PLACES)
    assert code == 0, '\n'.join(errors)


def test_ament_pep257_finds_nothing() -> None:
    main = pytest.importorskip('ament_pep257.main', reason=f'ament_pep257 {WHERE}')
    assert main.main(argv=PLACES) == 0
