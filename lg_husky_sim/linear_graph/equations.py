# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The equations of a graph as text and LaTeX: continuity, compatibility and constitutive.

The order is Rowell and Wormley's (ch. 5): one continuity equation for each passive tree branch
(its through variable by those of the links), one compatibility equation for each passive link
(its across variable by those of the tree), one constitutive equation for each element, solved
for the element's primary variable.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import re
from typing import TYPE_CHECKING

from lg_husky_sim.linear_graph.elements import Branch, Kind, SOURCES
from lg_husky_sim.linear_graph.graph import LinearGraph
from lg_husky_sim.linear_graph.structure import analyse, Structure
import numpy as np

if TYPE_CHECKING:
    from lg_husky_sim.linear_graph.normal_tree import NormalTree
    from lg_husky_sim.linear_graph.symbolic import SymbolicStateSpace

PRODUCT = r' \, '
"""Between the factors of a product, so that upright names do not run together."""


@dataclass(frozen=True)
class Sum:
    """
    One equation of Kirchhoff's: one or more variables, each equal to a signed sum.

    Parameters
    ----------
    left : tuple of str
        Variables that are equal to the sum (several where they are all equal).
    right : tuple of (int, str)
        Signs and variables; empty for zero.

    """

    left: tuple[str, ...]
    right: tuple[tuple[int, str], ...]

    @property
    def text(self) -> str:
        """Return the equation in plain text."""
        return ' = '.join((*self.left, _signed([(s, v) for s, v in self.right])))

    @property
    def latex(self) -> str:
        """Return the equation in LaTeX."""
        right = _signed([(s, latex_of(v)) for s, v in self.right])
        return ' = '.join((*(latex_of(v) for v in self.left), right))


@dataclass(frozen=True)
class Constitutive:
    """The constitutive equation of one element, solved for its primary variable."""

    element: str
    text: str
    latex: str


@dataclass(frozen=True)
class Equations:
    """
    All equations of a graph.

    Parameters
    ----------
    tree : NormalTree
        Tree and links they are written for.
    continuity, compatibility : tuple of Sum
        Kirchhoff's laws for passive tree branches and passive links.
    constitutive : tuple of Constitutive
        One or two (two-ports) an element.

    """

    tree: NormalTree
    continuity: tuple[Sum, ...]
    compatibility: tuple[Sum, ...]
    constitutive: tuple[Constitutive, ...]

    @property
    def text(self) -> str:
        """All equations in plain text, with headings."""
        parts = ['Normal tree', f'  tree:  {", ".join(self.tree.tree)}',
                 f'  links: {", ".join(self.tree.links)}']
        if self.tree.dependent:
            parts.append(f'  excess storages: {", ".join(self.tree.dependent)}')
        for title, lines in (
                ('Continuity (through variables of passive tree branches)',
                 [e.text for e in self.continuity]),
                ('Compatibility (across variables of passive links)',
                 [e.text for e in self.compatibility]),
                ('Constitutive', [e.text for e in self.constitutive])):
            parts += ['', title, *(f'  {line}' for line in lines)]
        return '\n'.join(parts)

    @property
    def latex(self) -> str:
        """All equations as LaTeX, one align block for each kind."""
        blocks = []
        for title, lines in (('Continuity', [e.latex for e in self.continuity]),
                             ('Compatibility', [e.latex for e in self.compatibility]),
                             ('Constitutive', [e.latex for e in self.constitutive])):
            blocks.append(f'% {title}\n{aligned(lines)}')
        return '\n'.join(blocks)


def equations(graph: LinearGraph, *, by_element: bool = False) -> Equations:
    """
    Write down the equations of a graph.

    Parameters
    ----------
    graph : LinearGraph
        The graph.
    by_element : bool
        Write each element's value as the element's own name, as the paper does.

    Returns
    -------
    Equations

    Raises
    ------
    GraphError
        If the graph has no normal tree.

    """
    structure = analyse(graph)
    texts = {value.owner: value.owner if by_element else value.text
             for value in structure.values}
    passive = [at for at, edge in enumerate(graph.edges)
               if not (isinstance(edge.owner, Branch) and edge.owner.kind in SOURCES)]
    continuity = [_kirchhoff(structure, at) for at in passive if structure.in_tree[at]]
    compatibility = [_kirchhoff(structure, at) for at in passive if not structure.in_tree[at]]
    return Equations(structure.tree, _chained(continuity), _chained(compatibility),
                     tuple(_law(structure, at, texts) for at in range(len(graph.edges))))


def _kirchhoff(structure: Structure, edge: int) -> Sum:
    row = structure.secondary[edge]
    terms = sorted(((int(row[at]), int(at)) for at in np.flatnonzero(row)),
                   key=lambda term: (-term[0], term[1]))
    return Sum((structure.dual(edge).name,),
               tuple((sign, structure.primary(at).name) for sign, at in terms))


def _chained(sums: list[Sum]) -> tuple[Sum, ...]:
    """Join equations with one and the same variable on the right into a = b = c."""
    found: dict[tuple[tuple[int, str], ...], Sum] = {}
    for number, equation in enumerate(sums):
        plain = len(equation.right) == 1 and equation.right[0][0] == 1
        key = equation.right if plain else ((number, ''),)
        known = found.get(key)
        found[key] = equation if known is None else Sum(known.left + equation.left, known.right)
    return tuple(found.values())


def _law(structure: Structure, edge: int, texts: Mapping[str, str]) -> Constitutive:
    """Return the constitutive equation of an edge, solved for its primary variable."""
    graph = structure.graph
    owner = graph.edges[edge].owner
    primary, secondary = structure.primary(edge).name, structure.dual(edge).name
    if owner.characteristic is not None:
        known = structure.laws.get(edge) or structure.linear_laws[edge]
        arguments = dict(zip(known.arguments, known.of, strict=True))
        law = re.sub(r'\bz\d+\b', lambda match: arguments.get(match.group(), match.group()),
                     known.expression)
        latex = _value_latex(known.expression, {
            name: latex_of(text) for name, text in arguments.items()})
        return Constitutive(owner.name, f'{primary} = {law}',
                            f'{latex_of(primary)} = {latex}')
    if isinstance(owner, Branch) and owner.kind in SOURCES:
        return Constitutive(owner.name, f'{primary} = {owner.input_name}',
                            f'{latex_of(primary)} = {_symbol(owner.input_name)}')
    if isinstance(owner, Branch) and owner.kind in (Kind.A_TYPE, Kind.T_TYPE):
        value, value_latex = texts[owner.name], _value_latex(texts[owner.name])
        rate = rf'\frac{{d}}{{dt}} {latex_of(secondary)}'
        left, left_latex, right, right_latex = (
            (f'd {primary}/dt', rf'\frac{{d}}{{dt}} {latex_of(primary)}',
             secondary, latex_of(secondary)) if edge in structure.states else
            (primary, latex_of(primary), f'd {secondary}/dt', rate))
        divided = (edge in structure.states) != (edge in structure.stiff)
        factor = rf'\frac{{1}}{{{value_latex}}}' if divided else _bracketed(value_latex)
        return Constitutive(
            owner.name,
            f'{left} = {_over(right, value) if divided else _times(value, right)}',
            f'{left_latex} = {factor} {right_latex}')
    term = next(term for term in structure.terms if term.edge == edge)
    value = texts[owner.name]
    sign = '-' if term.sign < 0 else ''
    source = term.source.name
    right = _over(source, value) if term.inverse else _times(value, source)
    value_latex = _value_latex(value)
    factor = rf'\frac{{1}}{{{value_latex}}}' if term.inverse else _bracketed(value_latex)
    return Constitutive(owner.name, f'{primary} = {sign}{right}',
                        f'{latex_of(primary)} = {sign}{factor} {latex_of(source)}')


def _times(value: str, variable: str) -> str:
    return f'{value}*{variable}' if value.isidentifier() else f'({value})*{variable}'


def _over(variable: str, value: str) -> str:
    return f'{variable}/{value}' if value.isidentifier() else f'{variable}/({value})'


def _bracketed(latex: str) -> str:
    return rf'\left({latex}\right)' if re.search(r'[-+]', latex) else latex


def _value_latex(text: str, replaced: dict[str, str] | None = None) -> str:
    from lg_husky_sim.linear_graph.rational import to_sympy
    import sympy

    expression = to_sympy(text)
    names = {symbol: (replaced or {}).get(symbol.name, _symbol(symbol.name))
             for symbol in expression.free_symbols}
    return str(sympy.latex(expression, symbol_names=names, mul_symbol=PRODUCT))


_LETTERS = (
    'alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma tau '
    'upsilon phi chi psi omega Gamma Delta Theta Lambda Xi Pi Sigma Upsilon Phi Psi Omega')
_GREEK = {name: f'\\{name}' for name in _LETTERS.split()}
_VARIABLE = re.compile(r'(\w+)\((\w+?)(?:\.([12]))?\)')


def latex_of(variable: str) -> str:
    r"""
    Return a variable in LaTeX: ``omega(J_LW)`` is ``\omega_{J_{LW}}``.

    A port is written ``\omega_{TF_{1},1}``.
    """
    match = _VARIABLE.fullmatch(variable)
    if match is None:
        return _symbol(variable)
    symbol, name, port = match.groups()
    return f'{_GREEK.get(symbol, symbol)}_{{{_symbol(name)}{"," + port if port else ""}}}'


def _symbol(name: str) -> str:
    r"""
    Return a name with what follows its first underscore as an index.

    A name of several letters is upright, and no product: ``Cf`` is ``\mathrm{Cf}``.
    """
    head, _, index = name.partition('_')
    if not head:
        return rf'\mathrm{{{name}}}'.replace('_', r'\_')
    head = _GREEK.get(head, head if len(head) == 1 else rf'\mathrm{{{head}}}')
    body = index.replace('_', r'\_')
    return f'{head}_{{{body}}}' if body else head


def aligned(lines: list[str]) -> str:
    """Return equations as one LaTeX align block, aligned at their first equals sign."""
    body = ' \\\\\n'.join('  ' + line.replace(' = ', ' &= ', 1) for line in lines)
    return f'\\begin{{align}}\n{body}\n\\end{{align}}'


def state_equations(model: SymbolicStateSpace) -> tuple[str, ...]:
    """
    Return the state and output equations in plain text.

    Parameters
    ----------
    model : SymbolicStateSpace
        What ``derive`` has given.

    Returns
    -------
    tuple of str
        ``d x/dt = ...`` for each state, then ``y = ...`` for each output that is not a state.

    """
    lines = []
    columns = (*model.states, *model.inputs, *(f'd {name}/dt' for name in model.inputs),
               *(f'f[{name}]' for name in model.efforts))
    state = model.A.row_join(model.B).row_join(model.E).row_join(model.G)
    for at, name in enumerate(model.states):
        lines.append(f'd {name}/dt = {_linear(state.row(at), columns)}')
    output = model.C.row_join(model.D).row_join(model.F).row_join(model.L_c)
    for at, name in enumerate(model.outputs):
        if name not in model.states:
            lines.append(f'{name} = {_linear(output.row(at), columns)}')
    return tuple(lines)


def _linear(row: list[object], columns: tuple[str, ...]) -> str:
    terms = []
    for entry, column in zip(row, columns, strict=True):
        text = str(entry)
        if text == '0':
            continue
        if text in ('1', '-1'):
            terms.append(text.replace('1', '') + column)
        else:
            terms.append(f'{text}*{column}' if re.fullmatch(r'-?[\w*/.]+', text)
                         else f'({text})*{column}')
    return ' + '.join(terms).replace('+ -', '- ') or '0'


def _signed(terms: list[tuple[int, str]]) -> str:
    if not terms:
        return '0'
    text = ''
    for sign, name in terms:
        text += (' - ' if sign < 0 else ' + ') + name
    return text[3:] if text.startswith(' + ') else '-' + text[3:]
