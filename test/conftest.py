# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Robots with effects for every folder of tests, and the mark of those that look at the clock."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from lg_husky_sim.husky.effects import Effect, Onset
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.testing.machine import PatientClock
import pytest

ROOT = Path(__file__).resolve().parent.parent
REALTIME = {
    'test_contract_live.py', 'test_contract_node.py', 'test_contract_process.py',
    'test_contract_standard.py',
}
"""Files whose tests measure time or talk to live processes: a busy machine would fail them.
A single such test in another file has the marker itself."""
CLOCKED = ('test/ros', 'test/diagnosis/test_twin.py')
"""Where ./check looks for tests that look at the clock, lest it imports all others once more."""

LONGEST = ('test_tour.py', 'test_before_after_robot.py', 'test_diagnosis_names.py',
           'test_diagnosis_files.py', 'test_notebooks.py', 'test_api.py',
           'test_evaluation_paper.py')
"""Files whose tests take longest: begun first, so that no process waits for another's last one."""


def pytest_configure(config: pytest.Config) -> None:
    """Judge tests that look at the clock by what the machine allowed."""
    config.pluginmanager.register(PatientClock())


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Give the tests of those files the marker realtime; put the longest tests first."""
    for item in items:
        if item.path.name in REALTIME:
            item.add_marker(pytest.mark.realtime)
        if item.get_closest_marker('realtime') and not any(
                item.path.resolve().is_relative_to(ROOT / place) for place in CLOCKED):
            raise pytest.UsageError(f'{item.nodeid} looks at the clock, and ./check only has such '
                                    f'tests in {", ".join(CLOCKED)}')
    items.sort(key=lambda item: LONGEST.index(item.path.name) if item.path.name in LONGEST
               else len(LONGEST))


def _robot(*effects: str | Effect, onset: Onset | None = None, **values: float) -> Plant:
    structure = Structure(onset=onset)
    for effect in effects:
        structure = structure.with_effect(Effect(effect) if isinstance(effect, str) else effect)
    own = [p.parameter() for effect in structure.effects for p in effect.parameters()]
    parameters = load_model().parameters.with_entries(*own).replacing(values)
    return compile_model(structure).at(parameters)


@pytest.fixture(scope='session')
def robot() -> Callable[..., Plant]:
    """Return a function that makes the paper's Husky with effects and other numbers."""
    return _robot
