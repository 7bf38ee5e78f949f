# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Transfer functions, zeros, step and frequency responses of the linear part of a model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from lg_husky_sim.errors import GraphError, ParameterError
from lg_husky_sim.linear_graph.elements import Branch, SOURCES, TwoPort
from lg_husky_sim.linear_graph.export import linear
from lg_husky_sim.linear_graph.expressions import evaluate
from lg_husky_sim.linear_graph.graph import LinearGraph, suggestion
from lg_husky_sim.linear_graph.state_space import FloatArray, StateSpace
from lg_husky_sim.linear_graph.symbolic import SymbolicStateSpace
import numpy as np
from numpy.typing import ArrayLike, NDArray


def position(names: Sequence[str], name: str, what: str) -> int:
    """
    Return where a name stands; where there is one only, it need not be given.

    Raises
    ------
    GraphError
        If it is unknown, or must be given.
    """
    if name in names:
        return list(names).index(name)
    if name:
        raise GraphError(f'unknown {what} {name!r}{suggestion(name, names)}')
    if len(names) == 1:
        return 0
    raise GraphError(f'name one {what} of {", ".join(names)}' if names else
                     f'the graph has no {what}')


def transfer_function(model: SymbolicStateSpace, output: int, source: int,
                      numbers: Mapping[str, float] | None = None) -> Any:
    """
    Return C (s I - A)^-1 (B + s E) + D + s F for one output and one input.

    Parameters
    ----------
    model : SymbolicStateSpace
    output, source : int
        Which output and which input.
    numbers : mapping of str to float, optional
        Value of each symbol, taken as the decimal fraction that it is written as.

    Returns
    -------
    sympy.Expr
        A cancelled fraction in ``s``.

    Raises
    ------
    GraphError
        If an element is called ``s``.
    """
    import sympy
    from sympy.polys.matrices import DomainMatrix

    s = sympy.Symbol('s')
    given = {sympy.Symbol(name): sympy.Rational(repr(float(value)))
             for name, value in (numbers or {}).items()}
    parts = [getattr(model, name) for name in 'ABCDEF']
    if any(s in part.free_symbols for part in parts):
        raise GraphError("an element is called 's', as the variable of a transfer function is; "
                         'give it another name')
    a, b, c, d, e, f = (part.subs(given) for part in parts)
    n = len(model.states)
    pencil = s * sympy.eye(n) - a
    drive = b[:, source] + s * e[:, source]
    whole = pencil.row_join(-drive).col_join(
        c[output, :].row_join(sympy.Matrix([[d[output, source] + s * f[output, source]]])))

    def determinant(matrix: Any) -> Any:
        dense = DomainMatrix.from_Matrix(matrix).to_field()
        return dense.domain.to_sympy(dense.det())

    return sympy.factor_terms(sympy.cancel(
        determinant(whole) / (determinant(pencil) if n else sympy.Integer(1))))


def element_values(graph: LinearGraph, values: Mapping[str, float]) -> dict[str, float]:
    """Return the number of each element's value under the element's name, SI."""
    elements: list[Branch | TwoPort] = [*graph.branches, *graph.two_ports]
    found = dict(values)
    found.update({e.name: evaluate(e.value, values) for e in elements if e.characteristic is None
                  and not (isinstance(e, Branch) and e.kind in SOURCES)})
    return found


def zeros(fraction: Any) -> NDArray[np.complex128]:
    """Return where a fraction in ``s`` with numbers is zero [1/s], slowest last."""
    import sympy

    above = sympy.Poly(sympy.fraction(sympy.together(fraction))[0], sympy.Symbol('s'))
    found = np.roots([float(one) for one in above.all_coeffs()]).astype(np.complex128)
    return found[np.lexsort((found.imag, found.real))]


def step_response(space: StateSpace, times: ArrayLike, source: int) -> FloatArray:
    """
    Return the outputs after a unit step of one input from rest, the other inputs zero.

    Parameters
    ----------
    space : StateSpace
    times : array_like, shape (n_times,)
        Equally spaced from 0 [s].
    source : int
        Which input.

    Returns
    -------
    numpy.ndarray, shape (n_times, n_outputs)

    Raises
    ------
    ParameterError
        If the times are not equally spaced from 0.
    SettingsError
        If an output has the step's derivative in it.
    """
    from scipy.signal import lsim

    own = linear(space)
    t = np.asarray(times, dtype=np.float64)
    if t.ndim != 1 or t.size < 2 or t[0] != 0.0 or not np.allclose(np.diff(t), t[1]) or t[1] <= 0:
        raise ParameterError('times must be two or more, equally spaced from 0')
    if not own.states:
        return np.tile(own.D[:, source], (t.size, 1))
    system = (own.A, own.B[:, [source]], own.C, own.D[:, [source]])
    return np.asarray(lsim(system, np.ones(t.size), t)[1], dtype=np.float64).reshape(t.size, -1)


def frequency_response(space: StateSpace, rates: ArrayLike, output: int, source: int,
                       ) -> NDArray[np.complex128]:
    """
    Return one output per one input at each angular frequency.

    Parameters
    ----------
    space : StateSpace
    rates : array_like, shape (k,)
        Angular frequencies [rad/s].
    output, source : int
        Which output and which input.

    Returns
    -------
    numpy.ndarray of complex, shape (k,)

    Raises
    ------
    ParameterError
        If there is a pole at one of them.
    """
    found = []
    for rate in np.atleast_1d(np.asarray(rates, dtype=np.float64)):
        s = 1j * rate
        drive = space.B[:, source] + s * space.E[:, source]
        try:
            state = np.linalg.solve(s * np.eye(len(space.states)) - space.A, drive)
        except np.linalg.LinAlgError as error:
            raise ParameterError(f'there is a pole at {rate:g} rad/s; choose another angular '
                                 'frequency') from error
        found.append(space.C[output] @ state + space.D[output, source]
                     + s * space.F[output, source])
    return np.array(found, dtype=np.complex128)
