# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Netlists: read as meant, damaged ones refused in one line that names the place."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
import re

from lg_husky_sim.errors import GraphError, ModelFileError
from lg_husky_sim.linear_graph import (
    Characteristic,
    compile_numeric,
    derive,
    Domain,
    Form,
    Kind,
)
from lg_husky_sim.linear_graph.netlist import parse_netlist, read_netlist
from lg_husky_sim.linear_graph.netlist_schema import ELEMENTS
import numpy as np
import pytest

MOTOR = """
name: DC motor
parameters:
  k_t: 0.05 N·m/A
elements:
  V_s:   {is: voltage source, from: supply}
  R:     {is: resistor, from: supply, to: winding, value: 0.5 ohm}
  L:     {is: inductor, from: winding, to: motor, value: 2 mH}
  motor: {is: transformer, port 1: {domain: electrical, from: motor},
          port 2: {domain: rotational, from: shaft}, value: k_t}
  J:     {is: inertia, from: shaft, value: 1e-3 kg·m²}
  B:     {is: rotary damper, from: shaft, value: 2*b}
  drag:  {is: torque source, from: shaft, law: quadratic, of: [omega(J)], parameters: [c_d]}
outputs: [omega(J), i(L)]
"""


def test_a_motor_is_read_as_meant() -> None:
    found = parse_netlist(MOTOR)
    assert found.name == 'DC motor'
    assert found.outputs == ('omega(J)', 'i(L)')
    assert dict(found.values) == pytest.approx({'k_t': 0.05, 'R': 0.5, 'L': 2e-3, 'J': 1e-3})
    space = compile_numeric(found.graph, found.outputs).at({**found.values, 'b': 0.25})
    np.testing.assert_allclose(space.A, [[-500.0, 50.0], [-25.0, -250.0]])
    np.testing.assert_allclose(space.G, [[-1000.0], [0.0]])
    kinds = {b.name: b.kind for b in found.graph.branches}
    assert kinds == {'V_s': Kind.ACROSS_SOURCE, 'R': Kind.D_TYPE, 'L': Kind.T_TYPE,
                     'J': Kind.A_TYPE, 'B': Kind.D_TYPE, 'drag': Kind.THROUGH_SOURCE}


def test_every_everyday_name_makes_its_element() -> None:
    assert len(ELEMENTS) == 24
    for what, (kind, domain) in ELEMENTS.items():
        loss = {Domain.ELECTRICAL: 'resistor', Domain.TRANSLATIONAL: 'damper',
                Domain.ROTATIONAL: 'rotary damper', Domain.FLUID: 'valve',
                Domain.THERMAL: 'thermal resistance'}[domain]
        found = parse_netlist(f'elements: {{x: {{is: {what}, from: n}}, '
                              f'y: {{is: {loss}, from: n}}}}')
        branch = found.graph.branches[0]
        assert (branch.kind, branch.domain) == (kind, domain)
        assert (branch.tail, branch.head) == ('n', 'ground')


def test_forms_and_grounds() -> None:
    found = parse_netlist("""
        ground: {translational: wall}
        elements:
          m: {is: mass, from: body, to: wall}
          s: {is: spring, from: body, to: wall, value: 0.5 m/N, form: inertance}
        """)
    assert found.graph.ground_of(Domain.TRANSLATIONAL) == (Domain.TRANSLATIONAL, 'wall')
    assert found.graph.branches[1].form is Form.INERTANCE
    np.testing.assert_allclose(
        compile_numeric(found.graph).at({**found.values, 'm': 1.0}).A, [[0, -1], [2, 0]])
    assert str(derive(found.graph).A[1, 0]) == '1/s'


@pytest.mark.parametrize(('old', 'new', 'message'), [
    ('inertia', 'inertai', r"element 'J': is: 'inertai' is not an element; did you mean 'iner"),
    ('value: k_t', 'value: k_tt', r"parameter 'k_t' is used by no element; did you mean 'k_tt'"),
    ('N·m/A', 'rad/(N·m·s)', r"unit of 'motor': k_t with k_t .* does not fit a transformer"),
    ('2 mH', '2 mF', r"unit of 'L': L with L \[mF\] does not fit an electrical T-type"),
    ('from: shaft, value: 1e', 'value: 1e', r"element 'J': from is missing; it names the node"),
    ('outputs', 'output', r"the file: unknown key 'output'; did you mean 'outputs'"),
    ('[omega(J), i', '[omega(K), i', r"no branch 'K' in the graph"),
    ('0.5 ohm', '0.5*', r"branch 'R': expression '0.5\*' cannot be read"),
    ('value: 0.5', 'valeu: 0.5', r"element 'R': unknown key 'valeu'; did you mean 'value'"),
    ('from: motor}', 'from: motr}', r"node 'motor' has no branch but 'L'|node 'motr' has"),
    ('0.5 ohm', '0.5 psi', r"element 'R': value: unit 'psi': 'psi' is not a known unit"),
    ('0.5 ohm', '[1, 2]', r"element 'R': value must be a number with a unit"),
    ('0.5 ohm', '.inf', r"element 'R': value is not finite, or beyond 1e308"),
    ('  J:', '  R:', r'not YAML: R is given twice in line \d+'),
    ('rotational', 'rotary', r"port 2: domain 'rotary' must be one of electrical, trans"),
    ('law: quadratic', 'law: cubic', r"law 'cubic' takes 1 argument\(s\) in of \(z1: any "
     r'variable\) and 2 parameter\(s\) \(p1: slope at zero, p2: factor of the cube\), not 1 '),
    (', law: quadratic', '', r"element 'drag': of needs a law"),
    ('law: quadratic', 'value: x, law: quadratic', r"element 'drag': give a value or a law"),
    ('{is: voltage source, from: supply}', '7', r"element 'V_s' must be entries of the form"),
    ('k_t: 0.05 N·m/A', 'k t: 1', r"parameter name 'k t' must be ASCII letters"),
    ('J:     ', '7: ', r'elements: key 7 must be a text'),
])
def test_a_mistake_is_named_with_its_place(old: str, new: str, message: str) -> None:
    text = MOTOR.replace(old, new, 1)
    assert text != MOTOR
    with pytest.raises(ModelFileError, match=r'^motor\.yaml: ') as caught:
        parse_netlist(text, 'motor.yaml')
    assert re.search(message, str(caught.value)), caught.value
    assert '\n' not in str(caught.value)


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(ModelFileError, match='No such file'):
        read_netlist(tmp_path / 'none.yaml')
    for number, text in enumerate(('', '[]', 'elements: {}', 'elements: 3', '\x00')):
        path = tmp_path / f'{number}.yaml'
        path.write_text(text, encoding='utf-8')
        with pytest.raises(ModelFileError, match=str(path)):
            read_netlist(path)


GROUNDED = """
ground: {ground}
elements:
  V_s: {{is: voltage source, from: a{to}}}
  R:   {{is: resistor, from: a, to: b, value: 1}}
  C:   {{is: capacitor, from: b{to}, value: 1}}
  R_2: {{is: resistor, from: b{to}, value: 1}}
  T:   {{is: transformer, value: 1, port 1: {{domain: electrical, from: b{to}}},
        port 2: {{domain: rotational, from: s{turning}}}}}
  J:   {{is: inertia, from: s{turning}, value: 1}}
"""


@pytest.mark.parametrize(('ground', 'node', 'turning'), [
    ('gnd', 'gnd', 'gnd'), ('{electrical: gnd, rotational: frame}', 'gnd', 'frame')])
def test_what_is_left_out_is_the_ground_of_the_file(ground: str, node: str, turning: str) -> None:
    short = parse_netlist(GROUNDED.format(ground=ground, to='', turning=''))
    full = parse_netlist(GROUNDED.format(ground=ground, to=f', to: {node}',
                                         turning=f', to: {turning}'))
    assert short.graph == full.graph


def test_a_source_finds_its_way_back_through_the_ground_of_the_file() -> None:
    found = parse_netlist("""
        ground: gnd
        elements:
          V_s: {is: voltage source, from: a, to: gnd}
          R:   {is: resistor, from: a, to: b, value: 1}
          C:   {is: capacitor, from: b, value: 1}
          R_2: {is: resistor, from: b, value: 1}
        """)
    space = compile_numeric(found.graph).at(found.values)
    assert (space.A.tolist(), space.B.tolist()) == ([[-2.0]], [[1.0]])


def test_a_domain_without_ground_is_named() -> None:
    with pytest.raises(ModelFileError, match='the rotational domain has no ground'):
        parse_netlist(GROUNDED.format(ground='{electrical: gnd}', to='', turning=''))


MERGING = """
parameters: {r_0: 2, R: 3}
elements:
  R: {is: resistor, from: b, value: r_0}
  C: {is: capacitor, from: b, value: 1}
  I: {is: current source, from: b, law: R*z, of: [V(C)], parameters: [R]}
"""


def test_a_law_s_parameter_may_not_have_the_name_of_another_value() -> None:
    message = ("parameter 'R' of the law of 'I' has the name of element 'R', whose value is 'r_0';"
               ' give one of them another name')
    with pytest.raises(ModelFileError, match=f'^netlist: {message}$'):
        parse_netlist(MERGING)
    apart = parse_netlist(MERGING.replace('R*z', 'g*z').replace('[R]', '[g]')
                          .replace('R: 3', 'g: 3'))
    assert str(derive(apart.graph, by_element=True).A[0, 0]) == '(-R*g - 1)/(C*R)'
    one = parse_netlist(MERGING.replace('value: r_0', 'value: R').replace('r_0: 2, ', ''))
    assert str(derive(one.graph, by_element=True).A[0, 0]) == '(-R**2 - 1)/(C*R)'
    merged = apart.graph.replacing(replace(
        apart.graph.branches[2], characteristic=Characteristic('R*z', ('V(C)',), ('R',))))
    with pytest.raises(GraphError, match=message):
        derive(merged, by_element=True)
    assert str(derive(merged).A[0, 0]) == '(-R*r_0 - 1)/(C*r_0)'


@pytest.mark.parametrize(('value', 'why'), [
    ('1/0', 'division by zero'), ('k/(2 - 2)', 'division by zero'),
    ('k + sqrt(-1)', 'not real'), ('(1 - 2)**0.5', 'not real'), ('k*exp(1000)', 'too large'),
    ('1e200*1e200', 'too large'), ('((9**16)**16)**16', 'too large')])
def test_constants_that_cannot_be_evaluated_are_refused(value: str, why: str) -> None:
    text = f'elements: {{R: {{is: resistor, from: b, value: {value}}}, ' \
        'C: {is: capacitor, from: b, value: c}}'
    with pytest.raises(ModelFileError, match=f"branch 'R': .* cannot be evaluated: {why}$"):
        parse_netlist(text)


def test_a_division_by_zero_in_symbols_is_refused() -> None:
    found = parse_netlist('elements: {R: {is: resistor, from: b, value: 1/(a - a)}, '
                          'C: {is: capacitor, from: b, value: c}}')
    with pytest.raises(GraphError, match=r"expression '1/\(a - a\)' divides by zero whatever"):
        derive(found.graph)
