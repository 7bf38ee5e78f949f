# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A linear graph as `lg.graph` gives it: what it shows, and names that mean one thing."""

from __future__ import annotations

from typing import Any

import lg_husky_sim as lg
from lg_husky_sim.errors import GraphError, ModelFileError, ParameterError
from lg_husky_sim.linear_graph import Branch, derive, Domain, Kind, LinearGraph
from lg_husky_sim.linear_graph.netlist import parse_netlist
import pytest

DIVIDER = """
name: capacitive divider
elements:
  V_s: {is: voltage source, from: a}
  C_1: {is: capacitor, from: a, to: b, value: 1}
  C_2: {is: capacitor, from: b, value: 1}
  R:   {is: resistor, from: b, value: 1}
outputs: [V(C_2)]
"""
TANK = """
name: tank
elements:
  Q_in: {is: flow source, from: ground, to: a}
  C:    {is: tank, from: a, value: 1}
  out:  {is: valve, from: a, form: damping, law: orifice, of: [P(C)], parameters: [k, p_0]}
outputs: [P(C), Q(out)]
"""


def test_the_formula_of_a_notebook_has_the_rate_of_change_of_an_input() -> None:
    shown = str(lg.graph(DIVIDER)._repr_latex_())
    assert (r'\begin{bmatrix}\frac{C_{2}}{C_{1} + C_{2}}\end{bmatrix} '
            r'\frac{d}{dt} \begin{bmatrix} V_{s} \end{bmatrix}') in shown
    assert (shown[0], shown[-1], shown.count('$')) == ('$', '$', 2)


def test_the_formula_of_a_notebook_has_laws_that_are_not_linear() -> None:
    shown = str(lg.graph(TANK)._repr_latex_())
    assert (r'\begin{bmatrix}- \frac{1}{C}\end{bmatrix} \begin{bmatrix} f_{\mathrm{out}} '
            r'\end{bmatrix}') in shown
    assert r'\begin{bmatrix} P_{C} \end{bmatrix} &= \begin{bmatrix}1\end{bmatrix}' in shown


def test_matrices_beyond_a_b_c_d_are_there_and_named() -> None:
    divider, tank = lg.graph(DIVIDER), lg.graph(TANK)
    assert [str(divider.E), str(divider.F)] == ['Matrix([[C_2/(C_1 + C_2)]])', 'Matrix([[0]])']
    assert str(tank.G) == 'Matrix([[-1/C]])'
    assert repr(divider) == ('<Graph capacitive divider: 4 branches; '
                             'dx/dt = A x + B u + E du/dt; y = C x + D u>')
    assert repr(tank) == ('<Graph tank: 3 branches; dx/dt = A x + B u + G f(z); '
                          'y = C x + D u + L_c f(z); z = H x>')
    assert '  dx/dt = A x + B u + E du/dt, y = C x + D u' in divider.text().splitlines()
    assert 'the states are x - E u' in divider.text()
    assert 'dx/dt = A x + B u + E du/dt' in str(divider.numeric()).splitlines()


RC = 'elements: {{V: {{is: voltage source, from: a{source}}}, {more}, ' \
     'C: {{is: capacitor, from: b, value: 1}}}}'


@pytest.mark.parametrize(('source', 'more', 'parameters', 'message'), [
    ('', 'R1: {is: resistor, from: a, to: b, value: 2*R1}', 'R1: 5',
     "parameter 'R1' of 'R1' has the name of element 'R1', whose value is '2*R1'"),
    ('', 'R1: {is: resistor, from: a, to: b, value: R2}, '
     'R2: {is: resistor, from: b, value: 3*p}', 'p: 5',
     "parameter 'R2' of 'R1' has the name of element 'R2', whose value is '3*p'"),
    (', value: R', 'R: {is: resistor, from: a, to: b, value: 1}', '',
     "the input 'R' of source 'V' has the name of the parameter of 'R'"),
    (', value: p', 'R: {is: resistor, from: a, to: b, value: 2*p}', 'p: 1',
     "the input 'p' of source 'V' has the name of the parameter of 'R'"),
    (', value: R', 'R: {is: resistor, from: a, to: b, value: 2*p}', 'p: 1',
     "the input 'R' of source 'V' has the name of the value of an element"),
])
def test_a_name_means_one_thing(source: str, more: str, parameters: str, message: str) -> None:
    text = RC.format(source=source, more=more)
    if parameters:
        text += f'\nparameters: {{{parameters}}}'
    with pytest.raises(ModelFileError) as caught:
        parse_netlist(text)
    assert str(caught.value) == f'netlist: {message}; give one of them another name'


def test_a_name_means_one_thing_in_graphs_made_in_python() -> None:
    graph = LinearGraph((
        Branch('R', Kind.D_TYPE, Domain.ELECTRICAL, 'a', 'ground', '2*R'),
        Branch('C', Kind.A_TYPE, Domain.ELECTRICAL, 'a', 'ground', 'C')))
    with pytest.raises(GraphError, match=r"'R', whose value is '2\*R'; give one of them"):
        derive(graph, by_element=True)
    assert str(derive(graph).A) == 'Matrix([[-1/(2*C*R)]])'


@pytest.mark.parametrize(('name', 'why'), [
    ('pi', 'is a constant of expressions; choose another name'),
    ('sin', 'is a function of expressions; choose another name'),
    ('lambda', 'is a reserved word; choose another name'),
    ('nan', 'is no finite number and no name; write a number or another name'),
    ('a-b', 'must be ASCII letters, digits and underscores, and not start with a digit')])
def test_names_that_mean_something_else_are_refused(name: str, why: str) -> None:
    resistor = f'{name}: {{is: resistor, from: a, to: b, value: 1}}'
    with pytest.raises(ModelFileError, match=f"^netlist: element name '{name}' {why}$"):
        parse_netlist(RC.format(source='', more=resistor))
    with pytest.raises(ModelFileError, match=f"^netlist: parameter name '{name}' {why}$"):
        parse_netlist(RC.format(source='', more='R: {is: resistor, from: a, to: b, value: 1}')
                      + f'\nparameters: {{{name}: 1}}')
    with pytest.raises(GraphError, match=f"branch name '{name}' {why}$"):
        Branch(name, Kind.D_TYPE, Domain.ELECTRICAL, 'a', 'ground', '1')


@pytest.mark.parametrize(('value', 'why'), [
    ('nan', "'nan' is no finite number"), ('.nan', 'value is not finite, or beyond 1e308'),
    ('2*inf', "'inf' is no finite number"), ('2*lambda', "'lambda' is a reserved word"),
    ('q^2', r'write \*\* in place of \^ for a power')])
def test_values_that_are_none_are_refused_in_plain_words(value: str, why: str) -> None:
    with pytest.raises(ModelFileError, match=why):
        parse_netlist(RC.format(
            source='', more=f'R: {{is: resistor, from: a, to: b, value: {value}}}'))


@pytest.mark.parametrize('value', ['5 V', '5'])
def test_a_number_on_a_source_is_answered_with_what_belongs_there(value: str) -> None:
    with pytest.raises(ModelFileError, match=f"source 'V': input name '{value}' must be .*"
                       'the name of its input, so leave it out: numbers come when it is sim'):
        parse_netlist(RC.format(source=f', value: {value}',
                                more='R: {is: resistor, from: a, to: b, value: 1}'))


def test_a_ground_may_be_a_number() -> None:
    text = DIVIDER.replace('from: b,', 'from: b, to: 0,').replace('from: a}', 'from: a, to: 0}')
    assert str(lg.graph(f'ground: 0\n{text}').A) == str(lg.graph(DIVIDER).A)
    assert str(lg.graph(f'ground: {{electrical: 0}}\n{text}').A) == str(lg.graph(DIVIDER).A)


def test_only_elements_that_have_a_form_are_told_to_change_it() -> None:
    text = """
    parameters: {r: 1 A/V}
    elements:
      C: {is: capacitor, from: a, value: 1}
      G: {is: gyrator, value: r, port 1: {domain: electrical, from: a},
          port 2: {domain: electrical, from: b}}
      C_2: {is: capacitor, from: b, value: 1}
    """
    with pytest.raises(ModelFileError, match=r'it is the inverse, so invert the value$'):
        parse_netlist(text)


def test_values_that_are_no_numbers_are_refused() -> None:
    values: list[Any] = ['3 ohm', None, 1j, [1.0], True]
    for value in values:
        with pytest.raises(ParameterError, match=r"parameter 'R' = .* must be a number, SI"):
            lg.graph(DIVIDER).poles(R=value)


def test_outputs_are_a_list_of_different_ones() -> None:
    text: Any = 'V(C_2)'
    with pytest.raises(GraphError, match=r"outputs = 'V\(C_2\)' must be a list, such as \['V\(C"):
        lg.graph(DIVIDER, text)
    with pytest.raises(GraphError, match=r"output 'V\(C_2\)' is named twice"):
        lg.graph(DIVIDER, ['V(C_2)', 'V(C_2)'])


def test_a_transfer_function_asks_for_names_and_one_form() -> None:
    one: Any = 1
    graph = lg.graph(DIVIDER)
    with pytest.raises(GraphError, match='1 must be the name of an output or an input'):
        graph.transfer_function(one, one)
    with pytest.raises(ParameterError, match='by_parameter is for symbols'):
        graph.transfer_function('V(C_2)', numbers=True, by_parameter=True)
    with pytest.raises(GraphError, match=r"name one, such as output='V\(C_1\)'"):
        lg.graph(DIVIDER.partition('outputs')[0]).transfer_function()


def test_a_notebook_says_why_a_graph_cannot_be_derived() -> None:
    broken = lg.graph(DIVIDER, ['V(Q)'])
    assert broken._repr_latex_() is None
    assert 'no branch &#x27;Q&#x27;' in broken._repr_html_()
