# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A maker of robots with effects, for every folder of tests."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.husky.effects import Effect, Onset
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
import pytest


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
