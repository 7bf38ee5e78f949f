# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Algebraic equations that have no single solution, and whose values make them so."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from lg_husky_sim.errors import ParameterError
from lg_husky_sim.linear_graph.elements import Branch, TwoPort
from lg_husky_sim.linear_graph.graph import LinearGraph
from lg_husky_sim.linear_graph.modular import generic_numbers, PRIME
from lg_husky_sim.linear_graph.state_space import FloatArray
import numpy as np

SUSPICIOUS = 1e9
"""A solution this many times the right side is looked at: cheap, and no judgement by itself."""

TREMOR = 1e-13
"""Relative change of every coefficient, some hundred times their rounding, …"""

CHANGED = 0.1
"""… that may change a solution by less than this. A condition number would not do: it counts
units, and is the square of 1/difference where two-ports of almost equal ratios follow."""

SWEEPS = 10
"""Sweeps of scaling rows and columns, so that units do not count as bad conditioning."""

PART = 1e-6
"""Share in the equations' null direction from which on an element belongs to it."""


def is_rounding(matrix: FloatArray, right: FloatArray, solution: FloatArray) -> bool:
    """
    Tell whether a solution is made of the rounding of its equations' coefficients.

    Parameters
    ----------
    matrix, right, solution : numpy.ndarray, shapes (n, n), (n, m), (n, m)
        Coefficients, right-hand sides and what solves them.

    """
    largest = np.abs(solution).max(initial=0.0)
    if not largest > SUSPICIOUS * np.abs(right).max(initial=0.0):
        return False
    signs = np.array(generic_numbers(matrix.size)).reshape(matrix.shape) / (PRIME / 2) - 1.0
    try:
        other = np.linalg.solve(matrix * (1.0 + TREMOR * signs), right)
    except np.linalg.LinAlgError:
        return True
    return bool(np.abs(other - solution).max() > CHANGED * largest)


def culprits(matrix: FloatArray) -> tuple[int, ...]:
    """
    Return the unknowns that singular equations leave open.

    Parameters
    ----------
    matrix : numpy.ndarray, shape (n, n)
        Coefficients of the equations, in any units.

    Returns
    -------
    tuple of int
        Positions.

    """
    if not np.isfinite(matrix).all():
        return tuple(range(len(matrix)))
    scaled = np.array(matrix)
    for _ in range(SWEEPS):
        for axis in (1, 0):
            largest = np.abs(scaled).max(axis=axis, keepdims=True)
            root = np.sqrt(np.where(largest > 0.0, largest, 1.0))
            scaled = scaled / root
    null = np.abs(np.linalg.svd(scaled)[2][-1])
    return tuple(int(at) for at in np.flatnonzero(null > PART * null.max()))


def singular_error(graph: LinearGraph, owners: Sequence[str], values: Mapping[str, float],
                   ) -> ParameterError:
    """
    Return the error for algebraic equations without a single solution.

    Parameters
    ----------
    graph : LinearGraph
        Says which of the elements are two-ports or modulated sources.
    owners : sequence of str
        Elements whose equations they are.
    values : mapping of str to float
        Value of each element.

    """
    two_ports = {two_port.name: two_port for two_port in graph.two_ports}
    ratios = [f'{name} = {values[name]:g}' for name in owners if name in two_ports]
    gains = [name for name in owners if name not in two_ports and _is_modulated(graph, name)]
    advice = []
    if ratios:
        advice.append(f'the ratios of the two-ports {", ".join(ratios)}: such as they are, they '
                      'short or open a part of the graph')
    if gains:
        advice.append(f'the gains of modulated sources {", ".join(gains)}')
    return ParameterError(
        f'the algebraic equations of {", ".join(owners)} have no single solution with these '
        f'values; check {" and ".join(advice) or "the values"}')


def _is_modulated(graph: LinearGraph, name: str) -> bool:
    owner: Branch | TwoPort = graph.edges[graph.edge_index(name)].owner
    return owner.characteristic is not None
