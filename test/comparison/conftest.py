# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings made in memory, and the real ones where they are at hand."""

from __future__ import annotations

from collections.abc import Callable
import os
from pathlib import Path

from lg_husky_sim.comparison.models import load_plants, NamedPlant
from lg_husky_sim.comparison.output import simulate_commands
from lg_husky_sim.manoeuvres import find_manoeuvre
from lg_husky_sim.recording import Recording
import pytest

ROOT = Path(__file__).resolve().parent.parent.parent


@pytest.fixture(scope='session')
def paper() -> NamedPlant:
    """Return the Husky with the paper's parameters."""
    (named,) = load_plants()
    return named


@pytest.fixture(scope='session')
def drive(paper: NamedPlant) -> Callable[[str], Recording]:
    """Return a function that drives the paper's Husky through a built-in manoeuvre."""
    def made(name: str) -> Recording:
        commands = find_manoeuvre(name).commands()
        return Recording(name, name, simulate_commands(paper.plant, commands, 3.5), 10**18,
                         frames=('odom', 'base_link'))
    return made


@pytest.fixture(scope='session')
def recordings() -> Path:
    """Return the folder of real recordings; skip where it is not at hand."""
    place = Path(os.environ.get('LG_HUSKY_RECORDINGS', ROOT.parent / 'shared' / 'recordings'))
    if not place.is_dir():
        pytest.skip(f'REAL RECORDINGS NOT TESTED: there are none in {place}; '
                    'set LG_HUSKY_RECORDINGS to their folder')
    return place
