# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What `lg.graph` takes for a graph, and answers about what does not settle."""

from __future__ import annotations

from pathlib import Path

import lg_husky_sim as lg
from lg_husky_sim.errors import ModelFileError
import numpy as np
import pytest

FREE = """
elements:
  F: {is: force source, from: ground, to: a}
  M_1: {is: mass, from: a, value: 3.3}
  B: {is: damper, from: a, to: b, value: 0.7}
  M_2: {is: mass, from: b, value: 1.9}
outputs: [v(M_1), F(B)]
"""
SWING = """
elements:
  F: {is: force source, from: ground, to: m}
  M: {is: mass, from: m, value: 1}
  K: {is: spring, from: m, value: 4}
outputs: [F(K)]
"""
PUSHED = """
elements:
  F: {is: force source, from: ground, to: m}
  M: {is: mass, from: m, value: 2}
  P: {is: force source, from: ground, to: m, law: proportional, of: [v(M)], parameters: [k]}
parameters: {k: 4}
outputs: [v(M)]
"""


def test_an_empty_source_is_called_so() -> None:
    with pytest.raises(ModelFileError, match=r'^no netlist given: the source is empty$'):
        lg.graph('')


def test_the_text_of_a_netlist_may_be_one_line() -> None:
    graph = lg.graph('{elements: {V: {is: voltage source, from: a}, '
                     'R: {is: resistor, from: a, value: 4}}, outputs: [i(R)]}')
    assert graph.step([0.0, 1.0]).values.tolist() == [[0.25], [0.25]]


def test_a_model_file_is_a_graph_too(tmp_path: Path) -> None:
    path = lg.Husky(mass=60.0).save(tmp_path / 'model.yaml')
    found = lg.graph(path)
    assert isinstance(found, lg.Husky)
    np.testing.assert_array_equal(found.poles(), lg.Husky(path).poles())
    assert lg.graph(str(path), ['i(L_1)']).outputs == ('i(L_1)',)


@pytest.mark.parametrize(('text', 'line'), [
    (FREE, 'No steady state: v(M_1) (a pole at 0 integrates the input)'),
    (SWING, 'No steady state: F(K) (a pair of poles without damping swings on)'),
    (PUSHED, 'No steady state: v(M) (a pole at 2 1/s grows)')])
def test_an_output_without_a_steady_state_says_why(text: str, line: str) -> None:
    step = lg.graph(text).step()
    assert str(step).splitlines()[-1] == line
    assert line in step._repr_html_()


def test_an_output_that_settles_beside_one_that_does_not_has_its_value() -> None:
    """The damper pulls the second mass along: M_2/(M_1 + M_2) of the force."""
    step = lg.graph(FREE).step()
    assert np.isnan(step.final[0])
    assert step.final[1] == pytest.approx(1.9 / (1.9 + 3.3))


def test_a_settled_output_needs_no_reason() -> None:
    assert 'steady' not in str(lg.Husky().step(source='V_S1'))


def test_poles_of_a_free_graph_are_zero_and_not_rounding() -> None:
    """One at 0, one at -B (1/M_1 + 1/M_2); an undamped pair has no real part."""
    three = FREE.replace('outputs', """  B_2: {is: damper, from: b, to: c, value: 1.7}
  M_3: {is: mass, from: c, value: 0.3}
outputs""").replace('3.3', '1.3').replace('1.9', '2.7').replace('0.7', '0.9')
    assert lg.graph(three).poles()[-1] == 0.0     # -1.1e-16 by the eigenvalues alone
    poles = lg.graph(FREE).poles()
    assert poles[-1] == 0.0
    assert poles[0] == pytest.approx(-0.7 * (1.0 / 3.3 + 1.0 / 1.9))
    assert lg.graph(SWING).poles().real.tolist() == [0.0, 0.0]
    assert lg.graph(SWING.replace('value: 4', 'value: 4e-9')).poles().imag == pytest.approx(
        [-6.3245553e-5, 6.3245553e-5])      # slow is not zero
