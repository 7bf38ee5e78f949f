# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""State-space matrices with the names of their rows and columns."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
MATRICES = ('A', 'B', 'C', 'D', 'E', 'F', 'G', 'H', 'K', 'L_c', 'N')

_EQUATIONS = (('states', 'dx/dt', 'A x', 'B u', 'E du/dt', 'G f(z)'),
              ('outputs', 'y', 'C x', 'D u', 'F du/dt', 'L_c f(z)'),
              ('arguments', 'z', 'H x', 'K u', 'N f(z)'))


def equation_forms(model: Any) -> tuple[str, ...]:
    """
    Return the equations that a model has, such as ``dx/dt = A x + B u``.

    Parameters
    ----------
    model : StateSpace or SymbolicStateSpace
        Matrices but A, B, C and D are left out where they are zero.

    Returns
    -------
    tuple of str
        Of x, and of y and z where there are any.

    """
    found = []
    for names, left, *terms in _EQUATIONS:
        if getattr(model, names):
            matrices = [(term, getattr(model, term.split()[0])) for term in terms]
            found.append(f'{left} = ' + ' + '.join(
                term for term, matrix in matrices if 0 not in matrix.shape
                and (term[0] in 'ABCD' or bool(np.any(np.asarray(matrix) != 0)))))
    return tuple(found)


@dataclass(frozen=True, eq=False)
class StateSpace:
    """
    Numbers of a state-space model derived from a linear graph.

    dx/dt = A x + B u + E du/dt + G f(z),  z = H x + K u + N f(z),
    y = C x + D u + F du/dt + L_c f(z)

    N is zero unless the model was compiled with chained efforts; then an effort may hang on
    others, but never on itself. E and F are zero unless the graph has excess storages that
    inputs act on (Rowell and Wormley, ch. 5.5); :meth:`standard_form` removes E.

    Parameters
    ----------
    A, B, E, G : numpy.ndarray, shapes (n, n), (n, m), (n, m), (n, k)
        State equations, SI.
    C, D, F, L_c : numpy.ndarray, shapes (p, n), (p, m), (p, m), (p, k)
        Output equations; L_c is the feed-through of efforts.
    H, K, N : numpy.ndarray, shapes (q, n), (q, m), (q, k)
        Arguments z of the efforts, one effort's after the other's.
    states, inputs, outputs, efforts, arguments : tuple of str
        Names of x (n), u (m), y (p), f (k) and z (q).

    """

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray
    E: FloatArray
    F: FloatArray
    G: FloatArray
    H: FloatArray
    K: FloatArray
    L_c: FloatArray
    N: FloatArray
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    efforts: tuple[str, ...]
    arguments: tuple[str, ...]

    def __post_init__(self) -> None:
        """Set the arrays read-only; they are made for this object by the derivation."""
        for name in MATRICES:
            self.__dict__[name].setflags(write=False)

    @property
    def poles(self) -> NDArray[np.complex128]:
        """
        Eigenvalues of A [1/s], shape (n,), slowest last, real first where equal.

        Parts that are no larger than rounding makes of a zero are zero.
        """
        from scipy.linalg import matrix_balance

        found: NDArray[np.complex128] = np.linalg.eigvals(self.A).astype(np.complex128)
        if found.size:
            rounding = found.size * np.finfo(float).eps * float(np.linalg.norm(
                matrix_balance(self.A)[0]))
            found.real[np.abs(found.real) <= rounding] = 0.0
            found.imag[np.abs(found.imag) <= rounding] = 0.0
        return found[np.lexsort((found.imag, found.real))]

    def standard_form(self) -> StateSpace:
        """
        Return the model without input derivatives in the state equations.

        The states become x' = x - E u (Rowell and Wormley, eq. 5.34 and below), so that
        dx'/dt = A x' + (B + A E) u + G f. Unchanged if E is zero.

        Returns
        -------
        StateSpace
            Same names; where E has a row that is not zero, the state is x - E u.

        """
        if not self.E.any():
            return self
        return replace(
            self, B=self.B + self.A @ self.E, D=self.D + self.C @ self.E,
            K=self.K + self.H @ self.E, E=np.zeros_like(self.E))

    def __str__(self) -> str:
        """Return all matrices that have entries, with their names."""
        parts = []
        for field in fields(self)[:len(MATRICES)]:
            matrix = getattr(self, field.name)
            if matrix.size and (field.name in 'ABCD' or matrix.any()):
                parts.append(f'{field.name} =\n{np.array2string(matrix, max_line_width=99)}')
        return '\n'.join([f'x = {", ".join(self.states)}', f'u = {", ".join(self.inputs)}',
                          f'y = {", ".join(self.outputs)}', *equation_forms(self),
                          *parts])
