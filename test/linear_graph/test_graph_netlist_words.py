# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Words and slips of a netlist that another word or a quotation mark would mend."""

from __future__ import annotations

import lg_husky_sim as lg
from lg_husky_sim.errors import LgHuskyError
import pytest

NETS: dict[str, tuple[str, str]] = {
    'pipe': ('elements: {p: {is: pipe, from: a}}', "'pipe' is not an element; write inertance"),
    'flywheel': ('elements: {f: {is: Flywheel, from: a}}', 'not an element; write inertia$'),
    'thermal capacitance': ('elements: {c: {is: thermal capacitance, from: a}}',
                            'not an element; write heat capacity$'),
    'fluid capacitor': ('elements: {c: {is: fluid capacitor, from: a}}', 'write tank$'),
    'conductor': ('elements: {c: {is: conductor, from: a}}', 'write resistor$'),
    'slip': ('elements: {r: {is: resitor, from: a}}', "did you mean 'resistor'"),
    'any': ('elements: {r: {is: thing, from: a}}', 'there are voltage source, .* tank, .*gyrator'),
    'node on': ('elements: {r: {is: resistor, from: on}}',
                "element 'r': from: True is no text; put the name of the node in quotes"),
    'node number': ('elements: {r: {is: resistor, from: 1.5}}', 'from: 1.5 is no text'),
    'element on': ('elements: {on: {is: resistor, from: a}}',
                   'key True must be a text; put it in quotes'),
    'form for from': ('elements: {r: {is: resistor, form: a}}',
                      r'from is missing; it names the node that the branch leaves \(there is '
                      r'form: in place of from:\)'),
    'source without from': (
        'elements: {F: {is: force source, to: m}, m: {is: mass, from: m, value: 1}}',
        "element 'F': from is missing; write from: ground for a source that pushes from there$"),
    'source without either node': (
        'elements: {V: {is: voltage source}}', 'it names the node that the branch leaves$'),
    'source without from, another ground': (
        'ground: wall\nelements: {F: {is: force source, to: m}, m: {is: mass, from: m}}',
        'write from: wall for a source'),
    'decimal comma': (
        "elements: {R: {is: resistor, from: a, value: '1,5 ohm'}}",
        r"^netlist: element 'R': value = '1,5 ohm' has a comma in its number; a decimal is "
        'written with a point$'),
    'decimal comma without quotes': (
        'elements: {R: {is: resistor, from: a, value: 1,5 ohm}}',
        "element 'R': '5 ohm' stands after a comma, which ends an entry; a decimal is written"),
    'decimal comma of a parameter': (
        "parameters: {d: '1,5'}\nelements: {r: {is: resistor, from: a, value: d}}",
        "parameter d = '1,5' has a comma in its number"),
    'negative resistance': (
        'elements: {R: {is: resistor, from: a, value: -3 ohm}}',
        "^netlist: element 'R': value = -3 ohm is not allowed; it must be zero or positive$"),
    'no mass': ('elements: {m: {is: mass, from: a, value: 0 kg}}',
                "^netlist: element 'm': value = 0 kg is not allowed; it must be positive$"),
    'ratio of nothing': (
        'elements: {t: {is: transformer, value: 0, port 1: {domain: electrical, from: a}, '
        'port 2: {domain: rotational, from: b}}}',
        "^netlist: element 't': value = 0 is not allowed; it must be not zero$"),
    'ground called gnd': (
        'elements: {V: {is: voltage source, from: a, to: gnd}, '
        'R: {is: resistor, from: a, to: gnd}}',
        "no branch touches node 'ground'; connect one of V, R to it, or say which node is ground: "
        'ground: gnd$'),
    'ground called 0': (
        'elements: {V: {is: voltage source, from: a, to: 0}, R: {is: resistor, from: a, to: 0}}',
        'or say which node is ground: ground: 0$'),
    'ground of another name': (
        'elements: {V: {is: voltage source, from: a, to: b}, R: {is: resistor, from: a, to: b}}',
        'or say which node is ground: ground: NODE$'),
    'a second ground': (
        'elements: {F: {is: force source, from: GND, to: m}, m: {is: mass, from: m}}',
        "connects node 'GND', .* in parallel, or write ground: GND if that node is ground$"),
    'a ground that floats': (
        'elements: {F: {is: force source, from: gnd, to: m}, b: {is: damper, from: m, to: gnd}, '
        'm: {is: mass, from: n}}',
        "node 'gnd' floats: .* to it, or write ground: gnd if that node is ground$"),
    'parameter with an expression': (
        'parameters: {d: 2*c}\nelements: {r: {is: resistor, from: a, value: d}}',
        r"parameter d = '2\*c' must be a number; expressions stand in the values of elements"),
    'parameter with a wrong unit': (
        'parameters: {d: 2 psi}\nelements: {r: {is: resistor, from: a, value: d}}',
        "parameter d: unit 'psi'"),
    'number too large': ('elements: {r: {is: resistor, from: a, value: 1e400}}',
                         "element 'r': value is not finite, or beyond 1e308"),
    'unit of the name of the element': ('elements: {R: {is: resistor, from: a, value: 1 R}}',
                                        "element 'R': value: unit 'R'"),
    'letters of Greece': ('elements: {R_α: {is: resistor, from: a, value: 1}}',
                          'must be ASCII letters'),
}


@pytest.mark.parametrize('name', NETS)
def test_the_remedy_is_said(name: str) -> None:
    text, message = NETS[name]
    with pytest.raises(LgHuskyError, match=message):
        lg.graph(text)
