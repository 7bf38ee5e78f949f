# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A derivation written out: equations, matrices and poles, as plain text or LaTeX."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from lg_husky_sim.linear_graph.elements import Branch, SOURCES, TwoPort
from lg_husky_sim.linear_graph.equations import Equations, latex_of, PRODUCT, state_equations
from lg_husky_sim.linear_graph.expressions import evaluate, names_in
from lg_husky_sim.linear_graph.graph import LinearGraph
from lg_husky_sim.linear_graph.numeric import NumericModel
from lg_husky_sim.linear_graph.state_space import equation_forms, MATRICES
from lg_husky_sim.linear_graph.symbolic import SymbolicStateSpace
from lg_husky_sim.linear_graph.units import unit_needed

_SHAPES = {'A': ('states', 'states'), 'B': ('states', 'inputs'), 'C': ('outputs', 'states'),
           'D': ('outputs', 'inputs'), 'E': ('states', 'inputs'), 'F': ('outputs', 'inputs'),
           'G': ('states', 'efforts'), 'H': ('arguments', 'states'),
           'K': ('arguments', 'inputs'), 'L_c': ('outputs', 'efforts'),
           'N': ('arguments', 'efforts')}


def text_report(title: str, steps: Equations, model: SymbolicStateSpace,
                graph: LinearGraph | None = None,
                numbers: tuple[NumericModel, Mapping[str, float]] | None = None,
                note: str = '') -> str:
    """
    Write a derivation as plain text.

    Parameters
    ----------
    title : str
        Heading.
    steps : Equations
        Kirchhoff's laws and constitutive equations.
    model : SymbolicStateSpace
        The result.
    graph : LinearGraph, optional
        Given, the elements' values are listed (where the equations write element names).
    numbers : tuple of (NumericModel, mapping), optional
        Given, the matrices in numbers and the poles are listed.
    note : str
        A line to write after the matrices.

    Returns
    -------
    str

    Raises
    ------
    ParameterError
        If a number is not allowed.

    """
    # Refuses numbers that are not allowed.
    poles = f'{_numbers(*numbers)}\n\n{_poles(*numbers)}' if numbers is not None else ''
    parts = [title, '=' * len(title), '', steps.text]
    if graph is not None:
        parts += ['', 'Values of the elements', *_values(graph, numbers[1] if numbers else {})]
    parts += ['', 'State-space model', f'  x = [{", ".join(model.states)}]',
              f'  u = [{", ".join(model.inputs)}]', f'  y = [{", ".join(model.outputs)}]']
    if model.efforts:
        parts += [f'  f = [{", ".join(model.efforts)}]',
                  f'  z = [{", ".join(model.arguments)}]']
    if model.dependent:
        parts.append(f'  excess storages, which add no state: {", ".join(model.dependent)}')
    parts.append(f'  {", ".join(equation_forms(model))}')
    if _is_shown('E', model.E):
        parts.append('  E acts on the rate of change of inputs; in standard form it is zero, and '
                     'the states are x - E u')
    parts += ['', *(f'  {line}' for line in state_equations(model)), '']
    for name in MATRICES:
        matrix = getattr(model, name)
        if _is_shown(name, matrix):
            parts += [f'{name} ({" by ".join(_SHAPES[name])})', *_table(matrix), '']
    return '\n'.join((*parts, *[note] * bool(note), poles)).rstrip()


def _is_shown(name: str, matrix: Any) -> bool:
    return 0 not in matrix.shape and (name in 'ABCD' or not matrix.is_zero_matrix)


def _values(graph: LinearGraph, numbers: Mapping[str, float]) -> list[str]:
    """List each element's expression, and its number and unit where all parameters have one."""
    lines = []
    elements: list[Branch | TwoPort] = [*graph.branches, *graph.two_ports]
    for element in elements:
        source = isinstance(element, Branch) and element.kind in SOURCES
        if element.characteristic is not None or source:
            continue
        parts = [element.name] + [element.value] * (element.value != element.name)
        if all(name in numbers for name in names_in(element.value)):
            parts.append(f'{evaluate(element.value, numbers):g} {unit_needed(element)}')
        if len(parts) > 1:
            lines.append('  ' + ' = '.join(parts))
    return lines


def _table(matrix: Any) -> list[str]:
    """Return a matrix of texts in columns; wide ones entry by entry."""
    rows, columns = matrix.shape
    cells = [[str(matrix[i, j]) for j in range(columns)] for i in range(rows)]
    widths = [max(len(row[j]) for row in cells) for j in range(columns)]
    if sum(widths) + 2 * columns <= 96:
        return ['  [' + '  '.join(cell.rjust(width) for cell, width in
                                  zip(row, widths, strict=True)) + ']' for row in cells]
    return [f'  ({i + 1},{j + 1}) = {cells[i][j]}' for i in range(rows)
            for j in range(columns) if cells[i][j] != '0']


def _poles(model: NumericModel, values: Mapping[str, float]) -> str:
    poles = model.at(values).poles
    shown = ', '.join(f'{p.real:.6g}' if p.imag == 0.0 else f'{p.real:.6g}{p.imag:+.6g}j'
                      for p in poles)
    what = 'Poles of the linear part' if model.efforts else 'Poles'
    return f'{what} with the numbers of the model [1/s]: {shown or "none, it has no state"}'


def _numbers(model: NumericModel, values: Mapping[str, float]) -> str:
    space = model.at(values)
    parts = ['With the numbers of the model (more digits: --export)']
    for name in MATRICES:
        matrix = getattr(space, name)
        if matrix.size and matrix.any():
            cells = [[f'{value:.6g}' for value in row] for row in matrix]
            widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
            parts += [f'{name} =', *('  ' + '  '.join(
                cell.rjust(width) for cell, width in zip(row, widths, strict=True))
                for row in cells)]
    return '\n'.join(parts)


def latex_report(title: str, steps: Equations, model: SymbolicStateSpace,
                 note: str = '') -> str:
    """
    Write a derivation as LaTeX (needs amsmath).

    Parameters
    ----------
    title : str
        Heading, written as a comment.
    steps : Equations
        Kirchhoff's laws and constitutive equations.
    model : SymbolicStateSpace
        The result.
    note : str
        A line to write below the title, as a comment.

    Returns
    -------
    str

    """
    parts = [*(f'% {" ".join(text.split())}' for text in (title, note) if text), steps.latex,
             '% State-space model']
    for left, terms in _equations_latex(model):
        right = ' + '.join(f'{matrix} {column}' for matrix, column in terms)
        parts.append(rf'\[ {left} = {right or 0} \]')
    parts += [rf'\[ {name} = {_matrix_latex(getattr(model, name))} \]' for name in MATRICES
              if _is_shown(name, getattr(model, name))]
    return '\n'.join(parts)


def state_equation_latex(model: SymbolicStateSpace) -> str:
    """Return the equations of x, y and z with their matrices as LaTeX, without delimiters."""
    lines = []
    for left, terms in _equations_latex(model):
        right = ' + '.join(f'{_matrix_latex(getattr(model, matrix))} {column}'
                           for matrix, column in terms)
        lines.append(f'{left} &= {right or 0}')
    return '\\begin{aligned} ' + r' \\ '.join(lines) + r' \end{aligned}'


def _equations_latex(model: SymbolicStateSpace) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return what stands left of each equation, and right of it matrices and their columns."""
    state, inputs = _column(model.states), _column(model.inputs)
    effort = _column(tuple(f'f({name})' for name in model.efforts))
    rate = rf'\frac{{d}}{{dt}} {inputs}'
    found = []
    for left, shown, terms in (
            (rf'\frac{{d}}{{dt}} {state}', model.states,
             (('A', state), ('B', inputs), ('E', rate), ('G', effort))),
            (_column(model.outputs), model.outputs,
             (('C', state), ('D', inputs), ('F', rate), ('L_c', effort))),
            (_column(model.arguments), model.arguments,
             (('H', state), ('K', inputs), ('N', effort)))):
        if shown:
            found.append((left, [(matrix, column) for matrix, column in terms
                                 if _is_shown(matrix, getattr(model, matrix))]))
    return found


def _matrix_latex(matrix: Any) -> str:
    import sympy

    names = {symbol: latex_of(symbol.name) for symbol in matrix.free_symbols}
    return str(sympy.latex(matrix, mat_str='bmatrix', mat_delim='', mul_symbol=PRODUCT,
                           symbol_names=names))


def _column(names: tuple[str, ...]) -> str:
    return r'\begin{bmatrix} ' + r' \\ '.join(latex_of(n) for n in names) + r' \end{bmatrix}'
