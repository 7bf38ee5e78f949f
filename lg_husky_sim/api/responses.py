# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What is asked of a linear system in class: transfer function, poles, zeros, step, Bode."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, TYPE_CHECKING

from lg_husky_sim.api.curves import FrequencyResponse, StepResponse
from lg_husky_sim.api.transfer_functions import root_text, TransferFunction, warn_of
from lg_husky_sim.errors import GraphError, ParameterError
from lg_husky_sim.linear_graph import Branch, compile_numeric, Kind, LinearGraph, StateSpace
from lg_husky_sim.linear_graph.state_space import FloatArray
import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from lg_husky_sim.linear_graph.modes import StepFigures
    from lg_husky_sim.linear_graph.nonlinear import RightHandSide


class Responses(ABC):
    """
    Answers of the linear part of a graph's model; laws that are not linear are left out.

    Only :meth:`right_hand_side` has them, for a solver. Results say by name what they are
    without; those that cannot (symbols, and systems of other tools) come with a warning. Where
    the graph has one output or one input only, it need not be named.
    """

    graph: LinearGraph
    values: Mapping[str, float]
    outputs: tuple[str, ...]
    source = ''

    @contextmanager
    def _in_file(self) -> Iterator[None]:
        """Let errors say which file they are about."""
        try:
            yield
        except (GraphError, ParameterError) as error:
            if not self.source or str(error).startswith(f'{self.source}: '):
                raise
            raise type(error)(f'{self.source}: {error}') from error

    @property
    def outside(self) -> str:
        """Return what not even the graph has; '' for nothing."""
        return ''

    @property
    @abstractmethod
    def left_out(self) -> str:
        """Return what the answers are without, as ``Without T_c: not linear``; '' for nothing."""

    @abstractmethod
    def numeric(self, **values: float) -> StateSpace:
        """Return the model in numbers."""

    def right_hand_side(self, **values: float) -> RightHandSide:
        """
        Return dx/dt as a function, with the laws that are not linear in it, for a solver.

        ``solve_ivp(graph.right_hand_side(), (0, 1), x0, args=(inputs,))``; the result's
        ``output(x, inputs)`` and ``efforts(x, inputs)`` give outputs and efforts of the laws.

        Parameters
        ----------
        **values : float
            Parameters by name, SI, in place of the graph's own.

        Returns
        -------
        RightHandSide
            Of a robot without what is outside its graph, such as a dead time; a warning says so.

        Raises
        ------
        GraphError
            If an input is differentiated.
        ParameterError
            If a parameter is unknown, has no number, or one that is not allowed.

        """
        from lg_husky_sim.linear_graph.nonlinear import RightHandSide
        with self._in_file():
            self.numeric(**values)      # refuses unknown names and what is no number
            found = RightHandSide(self.graph, {**self.values, **values}, self.outputs)
        warn_of(self.outside)
        return found

    def transfer_function(self, output: str = '', source: str = '', *, numbers: bool = False,
                          by_parameter: bool = False, **values: float) -> Any:
        """
        Return the transfer function from an input to an output.

        Parameters
        ----------
        output, source : str
            Names, such as ``'omega(J)'`` and ``'V_s'``; any variable of the graph is an output.
        numbers : bool
            Put the graph's numbers in; takes a second for 30 states, a minute for 100.
        by_parameter : bool
            In symbols, write the parameters' expressions instead of the elements' names. Where
            elements share parameters, more cancels: from one motor to the speed of the Husky's
            body, three of six poles.
        **values : float
            Parameters by name, SI, in place of the graph's own; then it is in numbers.

        Returns
        -------
        sympy.Expr or TransferFunction
            A fraction in ``s`` without common factors, in symbols by powers of ``s``; of the
            linear part alone (:attr:`left_out`).

        Raises
        ------
        GraphError
            If a name is unknown, an element is called ``s``, or the answer in symbols would fill
            hundreds of pages.
        ParameterError
            In numbers, if a parameter has no number or one that is not allowed, or
            `by_parameter` is asked for.

        """
        output, source = self._names(output, source)
        if by_parameter and (numbers or values):
            raise ParameterError('by_parameter is for symbols; leave it or the numbers out')
        if numbers or values:
            return self._in_numbers(output, source, values)
        from lg_husky_sim.linear_graph.transfer import transfer_function
        warn_of(self.left_out)
        return transfer_function(self.graph, output, source, by_element=not by_parameter)

    def _in_numbers(self, output: str, source: str, values: Mapping[str, float]
                    ) -> TransferFunction:
        from lg_husky_sim.linear_graph.exact import fraction_of
        self.numeric(**values)      # refuses numbers that are missing or not allowed
        found = fraction_of(self.graph, output, source, {**self.values, **values})
        return TransferFunction(output, source, self._unit(output, source), found.numerator,
                                found.denominator, found.zeros, found.poles, self.left_out)

    def poles(self, **values: float) -> NDArray[np.complex128]:
        """Return the eigenvalues of A [1/s], shape (n,), fastest first; of the linear part."""
        return self.numeric(**values).poles

    def zeros(self, output: str = '', source: str = '', **values: float
              ) -> NDArray[np.complex128]:
        """Return the zeros of a transfer function [1/s], without those that a pole cancels."""
        return self._in_numbers(*self._names(output, source), values).zeros

    def step(self, times: ArrayLike | None = None, output: str = '', source: str = '',
             **values: float) -> StepResponse:
        """
        Return the outputs of the linear part after a unit step of one input, from rest.

        What is not linear, as dry friction, is left out, and the result says so; with it,
        integrate :meth:`right_hand_side`.

        Parameters
        ----------
        times : array_like, shape (n_times,), optional
            Equally spaced from 0 [s]; until all outputs have settled by default.
        output, source : str
            Which output (all by default), and which input.
        **values : float
            Parameters by name, SI, in place of the graph's own.

        Returns
        -------
        StepResponse

        Raises
        ------
        GraphError
            If there is no output.
        SettingsError
            If an output begins with an impulse, as it has the step's derivative in it.
        ParameterError
            If the times are not equally spaced from 0, or a parameter has no number.

        """
        from lg_husky_sim.linear_graph.modes import StepFigures
        from lg_husky_sim.linear_graph.transfer import (
            checked_times,
            final_values,
            MOST_EXACT,
            step_response,
            usual_times,
        )
        first, source = self._names(output or self._first_output(), source)
        space = self._space(first if output else '', values)
        moments = usual_times(space.poles) if times is None else checked_times(times)
        column = space.inputs.index(source)
        found = step_response(space, moments, column)
        final = final_values(space, column)
        figures, notes = (StepFigures(),) * len(space.outputs), []
        if final is None or len(space.states) <= MOST_EXACT:
            answers = [self._in_numbers(name, source, values) for name in space.outputs]
            final = np.array([one.final_value for one in answers])
            notes = [_unsettled(answers)]
        if len(space.states) > MOST_EXACT:
            notes += [f'Figures are worked out for up to {MOST_EXACT} states']
        else:
            figures = tuple(one.step_figures(float(usual_times(one.poles)[-1])) for one in answers)
            late = max((one.settling or 0.0 for one in figures), default=0.0)
            if times is None and late > moments[-1]:
                moments = usual_times(space.poles, late)
                found = step_response(space, moments, column)
            notes += [_endless(space.outputs, figures)]
        notes += [_coarse(moments, space.poles)]
        return StepResponse(
            moments, found, space.outputs, tuple(map(self._unit, space.outputs)), source,
            self._unit(source), final, figures, self.left_out, '\n'.join(filter(None, notes)))

    def bode(self, rates: ArrayLike | None = None, output: str = '', source: str = '',
             **values: float) -> FrequencyResponse:
        """
        Return gain [dB] and phase [deg] of a transfer function, which is of the linear part.

        Parameters
        ----------
        rates : array_like, shape (k,), optional
            Angular frequencies [rad/s]; by default from a decade below all poles and zeros to
            one above, dense at resonances.
        output, source : str
            Names of the output and the input.
        **values : float
            Parameters by name, SI, in place of the graph's own.

        Returns
        -------
        FrequencyResponse
            ``gain, phase = graph.bode(rates)`` gives the arrays, the phase without jumps.

        Raises
        ------
        ParameterError
            If there is a pole at one of the frequencies, or a parameter has no number.

        """
        from lg_husky_sim.linear_graph.resonances import Factors, usual_rates
        from lg_husky_sim.linear_graph.transfer import (
            checked_rates,
            frequency_response,
            MOST_EXACT,
            phase_of,
        )
        output, source = self._names(output, source)
        space = self._space(output, values)
        fraction = None
        if rates is None or len(space.states) <= MOST_EXACT:
            fraction = self._in_numbers(output, source, values)
        if rates is None and fraction is not None:
            rates = usual_rates(np.concatenate([fraction.poles, fraction.zeros]))
        at = checked_rates([] if rates is None else rates)
        found = frequency_response(space, at, 0, space.inputs.index(source))
        unit = self._unit(output, source)
        if fraction is None:
            angles = np.rad2deg(np.unwrap(np.angle(found)))
            return FrequencyResponse(at, found, angles, output, source, unit, self.left_out)
        found = found if fraction.gain else 0.0 * found     # rounding, where nothing arrives
        one = Factors(fraction.gain, fraction.zeros, fraction.poles)
        marks = {'largest gain': one.largest(at), '3 dB below rest': one.bandwidth(at)
                 } if fraction.gain else {}
        places = np.array([rate for rate in marks.values() if rate is not None])
        angles = phase_of(np.append(at, places), one.zeros, one.poles, one.gain)
        figures = zip([name for name, rate in marks.items() if rate is not None],
                      map(float, places), map(float, one.decibels(places)),
                      map(float, angles[at.size:]), strict=True)
        return FrequencyResponse(at, found, angles[:at.size], output, source, unit, self.left_out,
                                 tuple(figures))

    def _names(self, output: str, source: str) -> tuple[str, str]:
        """Return the names of an output and an input; one that is alone need not be given."""
        from lg_husky_sim.linear_graph.transfer import position
        for name in (output, source):
            if not isinstance(name, str):
                raise GraphError(f'{name!r} must be the name of an output or an input')
        model = compile_numeric(self.graph, self.outputs, chained=True)
        source = model.inputs[position(model.inputs, source, 'input')]
        if not output:
            self._first_output()
            return model.outputs[position(model.outputs, '', 'output')], source
        try:        # any variable of the graph will do
            return self.graph.variable(output).name, source
        except GraphError as error:
            raise GraphError(f'unknown output: {error}') from error

    def _first_output(self) -> str:
        if not self.outputs:
            # Of an A-type where there is one: its across variable is a state, as a rule.
            edges = self.graph.edges
            at = next((place for place, edge in enumerate(edges) if isinstance(edge.owner, Branch)
                       and edge.owner.kind is Kind.A_TYPE), max(len(self.graph.branches) - 1, 0))
            name = self.graph.variable_name(at, True)
            raise GraphError(f"the graph has no output; name one, such as output='{name}'")
        return self.outputs[0]

    def _space(self, output: str, values: Mapping[str, float]) -> StateSpace:
        """Return the model in numbers with one output, any variable, or with all of its own."""
        space = self.numeric(**values)      # refuses numbers that are missing or not allowed
        if not output:
            return space
        return compile_numeric(self.graph, [output], chained=True).at({**self.values, **values})

    def _unit(self, name: str, over: str = '') -> str:
        from lg_husky_sim.linear_graph.units import quotient, unit_of
        own = unit_of(self.graph, name)
        if not over:
            return own
        below = unit_of(self.graph, over)
        return '' if own == below else quotient(own, below)


def _unsettled(answers: Sequence[TransferFunction]) -> str:
    """Say which outputs have no steady state, and for which poles."""
    why: dict[str, list[str]] = {}
    for one in answers:
        worst = max(one.poles, key=lambda pole: (pole.real, -abs(pole)), default=-1.0)
        if worst == 0.0:
            why.setdefault('a pole at 0 integrates the input', []).append(one.output)
        elif worst.real > 0.0:
            why.setdefault(f'a pole at {root_text(worst)} 1/s grows', []).append(one.output)
        elif worst.real == 0.0:
            why.setdefault('a pair of poles without damping swings on', []).append(one.output)
    said = '; '.join(f'{", ".join(names)} ({reason})' for reason, names in why.items())
    return f'No steady state: {said}' if said else ''


def _endless(names: Sequence[str], figures: Sequence[StepFigures]) -> str:
    """Say for which outputs figures are missing as they swing for too long."""
    found = [name for name, one in zip(names, figures, strict=True) if not one.complete]
    return (f'{", ".join(found)}: too many swings until the end for all figures' if found else '')


def _coarse(times: FloatArray, poles: NDArray[np.complex128]) -> str:
    """Say that samples are too far apart for a swing (the sampling theorem)."""
    fastest = float(np.abs(poles.imag).max(initial=0.0))
    if fastest * (times[1] - times[0]) < np.pi:
        return ''
    return (f'The times are too far apart to show the swing at {fastest:.6g} rad/s; the figures '
            'do not depend on them')
