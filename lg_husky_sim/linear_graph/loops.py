# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Which effort hangs on which: an order to evaluate them in, or the loop that forbids one."""

from __future__ import annotations

from collections.abc import Sequence
import itertools

from lg_husky_sim.errors import GraphError
import numpy as np
from numpy.typing import NDArray


def effort_order(direct: NDArray[np.bool_], counts: Sequence[int], efforts: Sequence[str],
                 arguments: Sequence[str], chained: bool) -> tuple[int, ...]:
    """
    Find an order in which all efforts can be evaluated.

    Parameters
    ----------
    direct : numpy.ndarray of bool, shape (q, k)
        Whether an argument hangs at once on an effort.
    counts : sequence of int
        Number of arguments of each effort, summing to q.
    efforts, arguments : sequence of str
        Their names.
    chained : bool
        Whether an effort may hang on others at all.

    Returns
    -------
    tuple of int
        Positions of the efforts.

    Raises
    ------
    GraphError
        If there is a loop, naming it; or any such dependence unless ``chained``.

    """
    owners = [effort for effort, count in enumerate(counts) for _ in range(count)]
    causes: dict[int, dict[int, str]] = {effort: {} for effort in range(len(efforts))}
    for row, column in zip(*np.nonzero(direct), strict=True):
        causes[owners[row]].setdefault(int(column), arguments[row])
    order: list[int] = []
    for effort in causes:
        _visit(effort, causes, order, [], efforts)
    if not chained:
        for effort, found in causes.items():
            for cause, argument in found.items():
                raise GraphError(
                    f'the argument {argument} of the non-linear law of {efforts[effort]!r} '
                    f'depends directly on the effort of {efforts[cause]!r}; put an energy storage '
                    'between them, make one law linear, or compile with chained=True')
    return tuple(order)


def _visit(effort: int, causes: dict[int, dict[int, str]], order: list[int], path: list[int],
           efforts: Sequence[str]) -> None:
    if effort in path:
        loop = [*path[path.index(effort):], effort]
        steps = [efforts[effort]]
        for later, earlier in itertools.pairwise(loop):
            steps += [causes[later][earlier], efforts[earlier]]
        raise GraphError(f'algebraic loop {" <- ".join(steps)}: a non-linear law depends '
                         'directly on itself; put an energy storage into the loop (an A-type in '
                         'parallel or a T-type in series), or make the law linear')
    if effort in order:
        return
    for cause in causes[effort]:
        _visit(cause, causes, order, [*path, effort], efforts)
    order.append(effort)
