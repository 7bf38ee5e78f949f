# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Transfer functions, step and frequency responses of the linear part of a model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from lg_husky_sim.errors import GraphError, ParameterError, SettingsError
from lg_husky_sim.linear_graph.cancelling import cancelled
from lg_husky_sim.linear_graph.checks import check_symbols
from lg_husky_sim.linear_graph.descriptor import between, descriptor, determinants
from lg_husky_sim.linear_graph.expressions import names_in
from lg_husky_sim.linear_graph.graph import LinearGraph, suggestion
from lg_husky_sim.linear_graph.rational import RationalField
from lg_husky_sim.linear_graph.state_space import FloatArray, StateSpace
from lg_husky_sim.linear_graph.structure import analyse
import numpy as np
from numpy.typing import ArrayLike, NDArray

SETTLED = 6.0
"""Time constants of the slowest pole that a response is shown for by default, where 0.25 % are
left; of the fastest that grows, if one does."""
PERIODS = 5.0
"""Periods shown by default where nothing decays."""
STEPS, FINEST = 500, 20_000
"""Least and most intervals of time by default."""
PER_FASTEST = 5.0
"""Intervals in a time constant of the fastest pole, as far as there may be so many."""
STANDING = 1e-9
"""Relative size below which a pole counts as zero, or its real part as none."""
MOST_EXACT = 40
"""States up to which poles and zeros are found exactly where they need not be."""


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


def transfer_function(graph: LinearGraph, output: str, source: str, *, by_element: bool = True
                      ) -> Any:
    """
    Return C (s I - A)^-1 (B + s E) + D + s F for one output and one input, in symbols.

    Parameters
    ----------
    graph : LinearGraph
        Of any elements; laws that are not linear count for nothing.
    output, source : str
        A variable, and the name of an input.
    by_element : bool
        Write each element's value as a symbol of the element's own name.

    Returns
    -------
    sympy.Expr
        A fraction without common factors, numerator and denominator by powers of ``s``.

    Raises
    ------
    GraphError
        If an element or a parameter is called ``s``, or the answer would be too long.

    """
    if by_element:
        check_symbols(graph)
    structure = analyse(graph, [output])
    texts = [value.owner if by_element and value.rule != 'any' else value.text
             for value in structure.values]
    if any('s' in names_in(text) for text in texts):
        raise GraphError("an element or a parameter is called 's', as the variable of a transfer "
                         'function is; give it another name')
    field = RationalField([*texts, 's'])
    values = [field.element(text) for text in texts]
    for value, known in zip(values, structure.values, strict=True):
        if not value and known.rule != 'any':
            raise GraphError(f'element {known.owner!r} is zero')
    rows = descriptor(structure, values, field.element('s'), field.one, structure.outputs[0],
                      structure.inputs.index(source))
    above, below = determinants(field, between(rows).of(rows))
    if not below:
        raise GraphError('the equations of the graph are singular whatever the parameters are')
    above, below = cancelled(above, below)
    return _by_powers(above) / _by_powers(below)


def _by_powers(polynomial: Any) -> Any:
    """Return a polynomial of a ring as an expression, by powers of ``s``."""
    import sympy

    ring = polynomial.ring
    if not polynomial:
        return sympy.Integer(0)
    front, polynomial = _monomial_first(polynomial)
    at = ring.symbols.index(sympy.Symbol('s'))
    parts: dict[int, dict[tuple[int, ...], Any]] = {}
    for powers, number in polynomial.terms():
        parts.setdefault(powers[at], {})[(*powers[:at], 0, *powers[at + 1:])] = number
    factors = [(power, *_monomial_first(ring.from_dict(part))) for power, part in parts.items()]
    return sympy.Mul(front, sympy.Add(*(
        own * rest.as_expr() * ring.symbols[at] ** power for power, own, rest in factors)))


def _monomial_first(polynomial: Any) -> tuple[Any, Any]:
    """Return the monomial that all terms have, as an expression, and what is left."""
    import sympy

    ring = polynomial.ring
    number, polynomial = polynomial.primitive()
    if max(polynomial.coeffs()) < 0:
        number, polynomial = -number, -polynomial
    least = tuple(map(min, zip(*polynomial.monoms(), strict=True)))
    front = sympy.Mul(number, *(symbol ** power for symbol, power in zip(
        ring.symbols, least, strict=True) if power))
    return front, ring.from_dict({
        tuple(power - low for power, low in zip(powers, least, strict=True)): factor
        for powers, factor in polynomial.terms()})


def expression(numerator: FloatArray, denominator: FloatArray) -> Any:
    """Return a fraction of polynomials in ``s`` as an expression."""
    import sympy

    s = sympy.Symbol('s')
    above, below = (sympy.Poly.from_list([sympy.Float(value) if value else 0
                                          for value in map(float, part)], s).as_expr()
                    for part in (numerator, denominator))
    return above / below


def usual_times(poles: NDArray[np.complex128], settling: float = 0.0) -> FloatArray:
    """Return times [s] from 0 for a response of these poles that settles at a time [s]."""
    moving = poles[np.abs(poles) > STANDING * np.abs(poles).max(initial=0.0)]
    ends = [SETTLED / abs(pole.real) if abs(pole.real) > STANDING * abs(pole)
            else PERIODS * 2.0 * np.pi / abs(pole) for pole in moving]
    growing = poles.real[poles.real > STANDING * np.abs(poles)]
    end = SETTLED / growing.max() if growing.size else max([settling, *ends]) or 1.0
    step = 10.0 ** np.floor(np.log10(end))      # a round one
    end = np.ceil(end / step) * step
    count = np.clip(PER_FASTEST * end * np.abs(poles).max(initial=0.0), STEPS, FINEST)
    return np.linspace(0.0, float(end), int(count) + 1)


def step_response(space: StateSpace, times: ArrayLike, source: int) -> FloatArray:
    """
    Return the outputs after a unit step of one input from rest, the other inputs zero.

    Parameters
    ----------
    space : StateSpace
        Whose outputs are wanted; all of them are returned.
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

    impulses = [name for name, row in zip(space.outputs, space.standard_form().F, strict=True)
                if row[source]]
    if impulses:
        raise SettingsError(f'the step response of {", ".join(impulses)} begins with an impulse, '
                            f'as it has the rate of change of {space.inputs[source]} in it; ask '
                            'for another output')
    own = space.standard_form()
    t = checked_times(times)
    if not own.states:
        return np.tile(own.D[:, source], (t.size, 1))
    system = (own.A, own.B[:, [source]], own.C, own.D[:, [source]])
    return np.asarray(lsim(system, np.ones(t.size), t)[1], dtype=np.float64).reshape(t.size, -1)


def final_values(space: StateSpace, source: int) -> FloatArray | None:
    """Return what the outputs settle at after a unit step; None unless all states settle."""
    own = space.standard_form()
    if not (own.poles.real < -STANDING * np.abs(own.poles).max(initial=0.0)).all():
        return None
    steady = np.linalg.solve(own.A, own.B[:, source])
    return np.asarray(own.D[:, source] - own.C @ steady, dtype=np.float64)


def checked_times(times: ArrayLike) -> FloatArray:
    """
    Return times [s] as an array of its own.

    Raises
    ------
    ParameterError
        If they are not equally spaced from 0.

    """
    t = _numbers(times)
    if t.ndim != 1 or t.size < 2 or t[0] != 0.0 or not t[1] > 0 or not np.allclose(
            np.diff(t), t[1], atol=0.0):
        raise ParameterError('times must be two or more, equally spaced from 0')
    return t


def checked_rates(rates: ArrayLike) -> FloatArray:
    """
    Return angular frequencies [rad/s] as an array of its own.

    Raises
    ------
    ParameterError
        If there is none, or one that is negative or not finite.

    """
    found = np.atleast_1d(_numbers(rates))
    if found.ndim != 1 or not found.size or not (np.isfinite(found) & (found >= 0.0)).all():
        raise ParameterError('rates must be one or more angular frequencies [rad/s], finite and '
                             'not negative')
    return found


def _numbers(values: ArrayLike) -> FloatArray:
    try:
        return np.array(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ParameterError(f'{values!r} is not an array of numbers') from error


def frequency_response(space: StateSpace, rates: ArrayLike, output: int, source: int,
                       ) -> NDArray[np.complex128]:
    """
    Return one output per one input at each angular frequency.

    Parameters
    ----------
    space : StateSpace
        In which the output and the input stand.
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
    for rate in checked_rates(rates):
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


def phase_of(rates: FloatArray, zeros: NDArray[np.complex128], poles: NDArray[np.complex128],
             gain: float) -> FloatArray:
    """
    Return the phase at angular frequencies [deg], from -180 to 180 at the lowest, without jumps.

    A pole or a zero on the imaginary axis counts as one a little to the left of it, so that the
    phase falls by 180 degrees at the resonance of what is not damped.
    """
    total = np.full(rates.shape, 0.0 if gain >= 0.0 else -180.0)
    for sign, roots in ((1.0, zeros), (-1.0, poles)):
        for root in roots:
            undamped = abs(root.real) <= STANDING * abs(root)
            real = 0.0 if undamped else -root.real      # not -0.0, whose angle is 180 degrees
            total += sign * np.rad2deg(np.arctan2(rates - root.imag, real))
    first = total[int(np.argmin(rates))]
    return np.asarray(total - 360.0 * np.floor((first + 180.0) / 360.0 + STANDING),
                      dtype=np.float64)
