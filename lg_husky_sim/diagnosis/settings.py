# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The numbers of a diagnosis: ``config/diagnosis.yaml``, each with unit, meaning and source."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from lg_husky_sim.settings import numbers


@cache
def settings() -> Mapping[str, float]:
    """Return the numbers of ``config/diagnosis.yaml`` by name."""
    return numbers('diagnosis.yaml', 'lg_husky_sim/diagnosis_settings/1')


def setting(name: str) -> float:
    """Return one number of ``config/diagnosis.yaml`` [its unit there]."""
    return settings()[name]
