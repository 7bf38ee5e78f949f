# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What is asked of a linear system in class: transfer function, poles, zeros, step, Bode."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

from lg_husky_sim.linear_graph import LinearGraph, StateSpace, SymbolicStateSpace
import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


class Responses(ABC):
    """
    Answers of the linear part of a graph's model; laws that are not linear are left out.

    Where the graph has one output or one input only, it need not be named.
    """

    graph: LinearGraph
    values: Mapping[str, float]

    @property
    @abstractmethod
    def symbolic(self) -> SymbolicStateSpace:
        """The model in symbols."""

    @abstractmethod
    def numeric(self, **values: float) -> StateSpace:
        """Return the model in numbers."""

    def transfer_function(self, output: str = '', source: str = '', *,
                          numbers: bool = False) -> Any:
        """
        Return the transfer function from an input to an output, in symbols and ``s``.

        Parameters
        ----------
        output, source : str
            Names, such as ``'omega(J)'`` and ``'V_s'``.
        numbers : bool
            Put the graph's numbers in first, as exact fractions: in symbols, many states (the
            Husky's six) take minutes.

        Returns
        -------
        sympy.Expr
            A cancelled fraction.

        Raises
        ------
        GraphError
            If a name is unknown, or an element is called ``s``.
        """
        from lg_husky_sim.linear_graph.transfer import element_values, transfer_function
        if numbers:
            self.numeric()          # refuses numbers that are missing or not allowed
        return transfer_function(self.symbolic, *self._positions(output, source),
                                 element_values(self.graph, self.values) if numbers else None)

    def poles(self, **values: float) -> NDArray[np.complex128]:
        """Return the eigenvalues of A [1/s], shape (n,), slowest last."""
        return self.numeric(**values).poles

    def zeros(self, output: str = '', source: str = '', **values: float
              ) -> NDArray[np.complex128]:
        """Return the zeros of a transfer function [1/s], without those that a pole cancels."""
        from lg_husky_sim.linear_graph.transfer import element_values, transfer_function, zeros
        self.numeric(**values)      # refuses numbers that are missing or not allowed
        numbers = element_values(self.graph, {**self.values, **values})
        return zeros(transfer_function(
            self.symbolic, *self._positions(output, source), numbers))

    def step(self, times: ArrayLike, source: str = '', **values: float) -> FloatArray:
        """
        Return the outputs after a unit step of one input, from rest.

        Parameters
        ----------
        times : array_like, shape (n_times,)
            Equally spaced from 0 [s].
        source : str
            Which input.
        **values : float
            Parameters by name, SI, in place of the graph's own.

        Returns
        -------
        numpy.ndarray, shape (n_times, n_outputs)

        Raises
        ------
        SettingsError
            If an output has the step's derivative in it (F is not zero).
        ParameterError
            If the times are not equally spaced from 0, or a parameter has no number.
        """
        from lg_husky_sim.linear_graph.transfer import position, step_response
        return step_response(self.numeric(**values), times,
                             position(self.symbolic.inputs, source, 'input'))

    def bode(self, rates: ArrayLike, output: str = '', source: str = '', **values: float
             ) -> tuple[FloatArray, FloatArray]:
        """
        Return gain [dB] and phase [deg] of a transfer function.

        Parameters
        ----------
        rates : array_like, shape (k,)
            Angular frequencies [rad/s].
        output, source : str
            Names of the output and the input.
        **values : float
            Parameters by name, SI, in place of the graph's own.

        Returns
        -------
        tuple of numpy.ndarray, shapes (k,) and (k,)
            The phase without jumps.
        """
        from lg_husky_sim.linear_graph.transfer import frequency_response
        found = frequency_response(self.numeric(**values), rates,
                                   *self._positions(output, source))
        return 20.0 * np.log10(np.abs(found)), np.rad2deg(np.unwrap(np.angle(found)))

    def _positions(self, output: str, source: str) -> tuple[int, int]:
        from lg_husky_sim.linear_graph.transfer import position
        model = self.symbolic
        return position(model.outputs, output, 'output'), position(model.inputs, source, 'input')
