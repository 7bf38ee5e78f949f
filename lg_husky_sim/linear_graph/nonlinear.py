# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The right-hand side of a graph with non-linear laws, for ODE solvers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import itertools

from lg_husky_sim.errors import GraphError, ParameterError
from lg_husky_sim.linear_graph.expressions import compile_tuple, GLOBALS
from lg_husky_sim.linear_graph.graph import LinearGraph, suggestion
from lg_husky_sim.linear_graph.numeric import compile_numeric
from lg_husky_sim.linear_graph.state_space import FloatArray
from lg_husky_sim.yaml_files import shown
import numpy as np
from numpy.typing import ArrayLike


class RightHandSide:
    """
    dx/dt and y of a graph with numbers in, laws evaluated at every call.

    Usable as it is with ``scipy.integrate.solve_ivp``: ``solve_ivp(rhs, (0, 1), x0, args=(u,))``.

    Parameters
    ----------
    graph : LinearGraph
        The graph.
    values : mapping of str to float
        Parameters of elements and of laws, SI.
    outputs : sequence of str
        Variables to put out.

    Attributes
    ----------
    space : StateSpace
        The matrices.

    Raises
    ------
    GraphError
        If the graph cannot be derived, a law hangs on itself, or an input is differentiated.
    ParameterError
        If a parameter is missing or not allowed.

    """

    def __init__(self, graph: LinearGraph, values: Mapping[str, float],
                 outputs: Sequence[str] = ()) -> None:
        """Put the numbers in and compile the laws."""
        model = compile_numeric(graph, outputs, chained=True)
        self.space = model.at(values)
        if self.space.E.any() or self.space.F.any():
            raise GraphError(
                f'excess storage {", ".join(model.dependent)} differentiates an input; take '
                'standard_form() of the model in numbers instead')
        structure = model.structure
        laws = [structure.characteristic(edge) for edge in structure.efforts]
        for name, law in zip(model.efforts, laws, strict=True):
            for parameter in law.parameters:
                if parameter not in values:
                    raise ParameterError(f'parameter {parameter!r} of the law of {name!r} has no '
                                         f'value{suggestion(parameter, values)}')
        self._codes = [compile_tuple((law.expression,)) for law in laws]
        self._scopes = [{p: float(values[p]) for p in law.parameters} for law in laws]
        starts = np.cumsum([0, *(len(law.of) for law in laws)])
        self._slices = [slice(int(a), int(b)) for a, b in itertools.pairwise(starts)]
        self._order = model.order
        self._globals = dict(GLOBALS)

    def efforts(self, state: ArrayLike, inputs: ArrayLike = ()) -> FloatArray:
        """Return all efforts f(z) [SI], shape (k,), at a state (n,) and inputs (m,)."""
        space = self.space
        arguments = space.H @ self._states(state) + space.K @ self._inputs(inputs)
        found = np.zeros(len(self._codes))
        for at in self._order:
            where = self._slices[at]
            z = arguments[where] + space.N[where] @ found
            scope = {f'z{i + 1}': float(value) for i, value in enumerate(z)}
            # only what parse() has checked is ever compiled
            found[at] = eval(  # noqa: S307
                self._codes[at], self._globals, {**self._scopes[at], **scope})[0]
        return found

    def _inputs(self, inputs: ArrayLike) -> FloatArray:
        return _numbers('input', inputs, self.space.inputs)

    def _states(self, state: ArrayLike) -> FloatArray:
        return _numbers('state', state, self.space.states)

    def __call__(self, time: float, state: ArrayLike, inputs: ArrayLike = ()) -> FloatArray:
        """
        Return dx/dt.

        Parameters
        ----------
        time : float
            Not used; solvers pass it.
        state : array_like, shape (n,)
            In the order of ``space.states``.
        inputs : array_like, shape (m,)
            In the order of ``space.inputs``.

        Returns
        -------
        numpy.ndarray, shape (n,)

        Raises
        ------
        ParameterError
            If there are more or fewer states or inputs than the graph has, or they are no numbers.

        """
        rate: FloatArray = (self.space.A @ self._states(state)
                            + self.space.B @ self._inputs(inputs)
                            + self.space.G @ self.efforts(state, inputs))
        return rate

    def output(self, state: ArrayLike, inputs: ArrayLike = ()) -> FloatArray:
        """Return the outputs, shape (p,), in the order of ``space.outputs``."""
        found: FloatArray = (self.space.C @ self._states(state)
                             + self.space.D @ self._inputs(inputs)
                             + self.space.L_c @ self.efforts(state, inputs))
        return found


def _numbers(what: str, given: ArrayLike, names: Sequence[str]) -> FloatArray:
    try:
        found = np.atleast_1d(np.asarray(given, dtype=np.float64))
    except (ValueError, TypeError) as error:
        raise ParameterError(f'{what}s = {shown(given)} are no numbers') from error
    if found.shape != (len(names),):
        said = f'{found.size} {what}(s)' if found.ndim == 1 else f'{what}s as a table'
        raise ParameterError(f'{said} given; the graph has {len(names)}: {", ".join(names)}')
    return found
