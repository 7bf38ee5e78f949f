# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The numbers of the blind trial, read from `config/blind_trial.yaml`."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

from lg_husky_sim.errors import SettingsError
from lg_husky_sim.resources import config_path
from lg_husky_sim.yaml_files import read_yaml


@cache
def settings() -> Mapping[str, Any]:
    """Return the whole file."""
    return read_yaml(config_path('blind_trial.yaml'), SettingsError)
