# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Optional dependencies: say in one line what to install where one is missing."""

from __future__ import annotations

from importlib.util import find_spec

from lg_husky_sim.errors import MissingExtraError

EXTRA_OF = {
    'control': 'tables',
    'cyclonedds': 'dds',
    'dask': 'scale',
    'deap': 'search',
    'distributed': 'scale',
    'jinja2': 'report',
    'matplotlib': 'plot',
    'mujoco': 'engine',
    'numba': 'fast',
    'pandas': 'tables',
    'plotly': 'report',
    'pybullet': 'bullet',
    'ray': 'ray',
    'rosbags': 'bags',
    'threadpoolctl': 'fast',
}
"""Importable module to the extra of setup.py that brings it."""


def require(module: str, purpose: str) -> None:
    """
    Refuse to go on without an optional dependency; call it just before importing it.

    Parameters
    ----------
    module : str
        One of `EXTRA_OF`.
    purpose : str
        What it is needed for, after "needed to", such as ``read recordings``.

    Raises
    ------
    MissingExtraError
        The module is not installed; the message says how to install it.

    """
    if find_spec(module) is None:
        # By its own name: no index has this package's extras; in a clone they are '.[extra]'.
        message = (f'{module} is needed to {purpose} and is not installed: pip install {module}, '
                   f"or in a clone pip install '.[{EXTRA_OF[module]}]'")
        raise MissingExtraError(message)
