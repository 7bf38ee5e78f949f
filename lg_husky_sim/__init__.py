# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Digital twin of the Clearpath Husky: read, derive, simulate, compare, identify, diagnose.

    import lg_husky_sim as lg

    recording = lg.read('drive')
    lg.Husky().diagnose(recording)

Names are imported when they are first used, so that the import itself takes no time.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any, TYPE_CHECKING

if TYPE_CHECKING:
    from lg_husky_sim.api.comparing import compare, Comparison
    from lg_husky_sim.api.diagnosing import DiagnosisResult
    from lg_husky_sim.api.graphs import Graph, graph
    from lg_husky_sim.api.identifying import Fit
    from lg_husky_sim.api.lists import list_effects, list_manoeuvres
    from lg_husky_sim.api.recordings import read, read_all, Recording
    from lg_husky_sim.api.robots import Husky, Number
    from lg_husky_sim.api.surveys import Survey
    from lg_husky_sim.errors import LgHuskyError

    __version__: str

__all__ = [
    'Comparison',
    'DiagnosisResult',
    'Fit',
    'Graph',
    'Husky',
    'LgHuskyError',
    'Number',
    'Recording',
    'Survey',
    '__version__',
    'compare',
    'graph',
    'list_effects',
    'list_manoeuvres',
    'read',
    'read_all',
]

_HOMES = {
    'Comparison': 'api.comparing',
    'DiagnosisResult': 'api.diagnosing',
    'Fit': 'api.identifying',
    'Graph': 'api.graphs',
    'Husky': 'api.robots',
    'LgHuskyError': 'errors',
    'Number': 'api.robots',
    'Recording': 'api.recordings',
    'Survey': 'api.surveys',
    'compare': 'api.comparing',
    'graph': 'api.graphs',
    'list_effects': 'api.lists',
    'list_manoeuvres': 'api.lists',
    'read': 'api.recordings',
    'read_all': 'api.recordings',
}
"""Public name to the module that holds it."""


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for (PEP 562)."""
    if name == '__version__':
        from importlib.metadata import PackageNotFoundError, version
        try:
            value: Any = version(__name__)
        except PackageNotFoundError:  # a source tree on the path, never installed
            value = '0+unknown'
    elif name in _HOMES:
        value = getattr(import_module(f'{__name__}.{_HOMES[name]}'), name)
    else:
        message = f'module {__name__!r} has no attribute {name!r}'
        raise AttributeError(message)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names, imported or not."""
    return sorted({*__all__, *(name for name in globals() if name.startswith('__'))})
