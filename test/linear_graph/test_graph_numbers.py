# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Numbers that are missing, misspelt or impossible together: each is said in plain words."""

from __future__ import annotations

from pathlib import Path
import re

import lg_husky_sim as lg
from lg_husky_sim.cli.main import run
from lg_husky_sim.errors import GraphError, ModelFileError, ParameterError
from lg_husky_sim.linear_graph import (
    Branch,
    compile_numeric,
    Domain,
    Kind,
    LinearGraph,
    NumericModel,
    TwoPort,
)
import pytest

E = Domain.ELECTRICAL
MISSPELT = """
name: divider
elements:
  V:  {is: voltage source, from: a}
  R1: {is: resistor, from: a, to: b, value: 3 Ω}
  R2: {is: resistor, from: b, value: 2*Rl}
  C:  {is: capacitor, from: b, value: 1 F}
"""


def loop() -> NumericModel:
    """Return two transformers in parallel: the less their ratios differ, the more flows."""
    return compile_numeric(LinearGraph(
        (Branch('V', Kind.ACROSS_SOURCE, E, 'a', 'ground'),
         Branch('L', Kind.T_TYPE, E, 'a', 'b', 'L'),
         Branch('R', Kind.D_TYPE, E, 'd', 'ground', 'R')),
        tuple(TwoPort(name, Kind.TRANSFORMER, (E, 'b', 'ground'), (E, 'd', 'ground'), name)
              for name in ('n', 'k'))), ['i(n.1)'])


@pytest.mark.parametrize('ratio', [0.3, 3 * 0.1])
def test_ratios_that_are_equal_up_to_rounding_have_no_solution(ratio: float) -> None:
    with pytest.raises(ParameterError) as caught:
        loop().at({'L': 1.0, 'R': 1.0, 'n': 0.3, 'k': ratio})
    assert str(caught.value) == (
        'the algebraic equations of n, k have no single solution with these values; check the '
        'ratios of the two-ports n = 0.3, k = 0.3: such as they are, they short or open a part of '
        'the graph')


@pytest.mark.parametrize('difference', [0.1, 1e-6, 1e-9])
def test_ratios_that_differ_have_one(difference: float) -> None:
    """All current of the coil, i1 + i2, with n i1 + k i2 = 0: i1 = k/(k - n) i."""
    ratio = 0.3 * (1.0 + difference)
    found = loop().at({'L': 1.0, 'R': 1.0, 'n': 0.3, 'k': ratio}).C[0, 0]
    assert found == pytest.approx(ratio / (ratio - 0.3), rel=1e-4)


def test_far_apart_values_are_not_taken_for_a_mistake() -> None:
    """A divider of 1e12 and 1e-6 ohm: condition by units is none."""
    model = compile_numeric(LinearGraph((
        Branch('V', Kind.ACROSS_SOURCE, E, 'a', 'ground'),
        Branch('R_1', Kind.D_TYPE, E, 'a', 'b', 'R_1'),
        Branch('R_2', Kind.D_TYPE, E, 'b', 'ground', 'R_2'),
        Branch('L', Kind.T_TYPE, E, 'b', 'ground', 'L'))), ['V(R_2)'])
    for one, two in ((1e12, 1e-6), (1e-6, 1e12)):
        found = model.at({'R_1': one, 'R_2': two, 'L': 1.0})
        assert found.D[0, 0] == pytest.approx(two / (one + two))


def test_a_misspelt_parameter_is_named_where_numbers_are_asked_for(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / 'divider.yaml'
    path.write_text(MISSPELT, encoding='utf-8')
    graph = lg.graph(path)
    said = "parameter 'Rl' of element 'R2' = 2*Rl has no value; did you mean 'R1'?"
    assert str(graph.A) == 'Matrix([[(-R1 - R2)/(C*R1*R2)]])'
    with pytest.raises(ParameterError) as caught:
        graph.numeric()
    assert str(caught.value) == f'{path}: {said}'
    assert graph.numeric(Rl=1.0).A.tolist() == [[pytest.approx(-5.0 / 6.0)]]
    assert run(['derive', str(path)]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == f'No numbers: {said}'
    assert f'% No numbers: {said}' in graph.latex().splitlines()


def test_a_graph_in_symbols_alone_is_not_said_to_lack_numbers() -> None:
    text = 'elements:\n  R: {is: resistor, from: a}\n  C: {is: capacitor, from: a}'
    assert 'No numbers' not in lg.graph(text).text()
    assert "No numbers: parameter 'R' of element 'R' has no value" in lg.graph(
        text.replace('capacitor, from: a', 'capacitor, from: a, value: 1')).text()


def test_parameters_of_laws_are_among_those_that_are_known() -> None:
    graph = lg.graph("""
        elements:
          F: {is: force source, from: ground, to: a}
          m: {is: mass, from: a, value: 1}
          d: {is: damper, from: a, law: quadratic, of: [v(d)], parameters: [k_d]}
        """)
    with pytest.raises(ParameterError, match=r"unknown parameter 'kk' \(known: m, k_d\)"):
        graph.numeric(kk=3)
    assert graph.numeric(k_d=3).A.tolist() == [[0.0]]
    assert 'Poles of the linear part with the numbers of the model [1/s]: 0' in graph.text()


def test_an_error_of_evaluation_names_the_file(tmp_path: Path) -> None:
    path = tmp_path / 'rc.yaml'
    path.write_text('elements: {R: {is: resistor, from: a, value: 1/(p - 1)}, '
                    'C: {is: capacitor, from: a, value: 1}}\nparameters: {p: 1}')
    for show in (lg.graph(path).text, lg.graph(path).numeric):
        with pytest.raises(ParameterError, match=r"rc\.yaml: element 'R' = .* division by zero$"):
            show()
    with pytest.raises(ParameterError, match=r"^element 'R'"):
        lg.graph(path.read_text()).numeric()


def test_a_graph_is_read_from_a_dict_too() -> None:
    data = {'elements': {'R': {'is': 'resistor', 'from': 'a', 'value': 2},
                         'C': {'is': 'capacitor', 'from': 'a', 'value': '3 F'}}}
    assert lg.graph(data).numeric().A.tolist() == [[-1 / 6]]
    with pytest.raises(ModelFileError, match=r"^netlist: .*key 'element'; did you mean"):
        lg.graph({'element': {}})


@pytest.mark.parametrize('source', [None, 3, ['R']])
def test_what_is_no_graph_is_refused_in_plain_words(source: object) -> None:
    said = f'^{re.escape(repr(source))} is no linear graph: lg.graph takes a netlist'
    with pytest.raises(GraphError, match=said):
        lg.graph(source)  # type: ignore[arg-type]


def test_a_misspelt_key_of_a_netlist_is_suggested(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / 'rc.yaml'
    path.write_text('element: {}')
    assert run(['derive', str(path)]) == 1
    assert "unknown key 'element'; did you mean 'elements'?" in capsys.readouterr().err
