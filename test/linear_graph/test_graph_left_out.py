# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Answers of a linear part say by name what is not linear and so not in them."""

from __future__ import annotations

from pathlib import Path
from typing import Any
import warnings

import lg_husky_sim as lg
from matplotlib.figure import Figure
import numpy as np
import pytest

MOTOR = """
name: motor with dry friction
elements:
  V: {is: voltage source, from: a}
  R: {is: resistor, from: a, to: b, value: 0.5 Ω}
  K: {is: transformer, port 1: {domain: electrical, from: b},
      port 2: {domain: rotational, from: d}, value: 0.05 V·s/rad}
  J: {is: inertia, from: d, value: 0.001 kg·m²}
  T_c: {is: torque source, from: d, law: LAW}
parameters: {T_0: 0.02 N·m, w_0: 0.1 rad/s}
outputs: [omega(J)]
"""
DRY = MOTOR.replace('LAW', 'coulomb, of: [omega(J)], parameters: [T_0, w_0]')
VISCOUS = MOTOR.replace('LAW', 'proportional, of: [omega(J)], parameters: [T_0]').replace(
    '0.02 N·m, w_0: 0.1 rad/s', '0.02 N·m·s/rad')
WITHOUT = 'Without T_c: not linear'


def test_a_step_a_bode_and_a_transfer_function_say_what_is_not_linear() -> None:
    graph = lg.graph(DRY)
    for answer in (graph.step(), graph.bode(), graph.transfer_function(numbers=True)):
        assert answer.left_out == WITHOUT
        assert WITHOUT in str(answer).splitlines()
        assert WITHOUT in answer._repr_html_()
    assert graph.step().table().rows[0][2] == pytest.approx(20.0)      # as without friction


def test_a_picture_says_so_too() -> None:
    drawn: Any = Figure().subplots(2, 1)
    lg.graph(DRY).step().plot(drawn[0])
    assert WITHOUT in drawn[0].get_title()
    drawn = Figure().subplots(2, 1)
    lg.graph(DRY).bode().plot(drawn)
    assert WITHOUT in drawn[0].get_title()


def test_what_cannot_say_so_comes_with_a_warning() -> None:
    graph = lg.graph(DRY)
    found = graph.transfer_function(numbers=True)
    for call in (graph.transfer_function, graph.to_control, graph.to_scipy, found.to_control,
                 found.to_scipy):
        with pytest.warns(UserWarning, match=WITHOUT) as record:
            call()
        assert record[0].filename == __file__


def test_a_linear_law_is_in_the_answers_and_not_named() -> None:
    graph = lg.graph(VISCOUS)
    assert graph.left_out == ''
    assert 'Without' not in str(graph.step())
    assert graph.step().table().rows[0][2] == pytest.approx(20.0 / (1.0 + 0.5 * 0.02 / 0.05**2))
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        graph.to_control()


def test_effects_of_a_robot_are_named_by_their_ids() -> None:
    husky = lg.Husky().with_effect('coulomb_drivetrain', dry_torque=10.0)
    step = husky.step(source='V_S1')
    assert step.left_out == 'Without coulomb_drivetrain: not linear'
    late = husky.with_effect('command_latency').with_effect('traction_saturation')
    assert late.bode(output='v(M_H)', source='V_S1').left_out == (
        'Without coulomb_drivetrain, traction_saturation: not linear. '
        'Without command_latency: outside the graph')
    assert lg.Husky().with_effect('payload').left_out == ''     # in the matrices


def test_the_right_hand_side_has_what_is_not_linear() -> None:
    """Rates by hand: (torque of the motor - dry friction) over the inertia."""
    dry, smooth = lg.graph(DRY), lg.graph(DRY).right_hand_side(T_0=0.0)
    full = dry.right_hand_side()
    state, inputs = [2.0], [6.0]
    free = 0.05 * (6.0 - 0.05 * 2.0) / 0.5 / 0.001
    assert smooth(0.0, state, inputs) == pytest.approx([free])
    assert full(0.0, state, inputs) == pytest.approx([free - 0.02 * np.tanh(20.0) / 0.001])
    assert full.output(state, inputs) == pytest.approx([2.0])
    assert abs(full.efforts(state, inputs)) == pytest.approx([0.02 * np.tanh(20.0)])


def test_the_right_hand_side_of_a_robot_warns_of_what_is_outside_its_graph() -> None:
    husky = lg.Husky().with_effect('coulomb_drivetrain', dry_torque=10.0)
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        rates = husky.right_hand_side()(0.0, [1.0, 1.0, 0.2, 0.0, 0.0, 0.0], [0.0, 0.0])
    assert rates[0] == rates[1] < 0.0
    assert rates[0] < lg.Husky().right_hand_side()(0.0, [1.0, 1.0, 0.2, 0.0, 0.0, 0.0],
                                                   [0.0, 0.0])[0]
    late = husky.with_effect('command_latency')
    with pytest.warns(UserWarning, match='Without command_latency: outside the graph') as record:
        late.right_hand_side()
    assert record[0].filename == __file__


def test_mistakes_in_a_right_hand_side_are_named_with_the_file(tmp_path: Path) -> None:
    path = tmp_path / 'motor.yaml'
    path.write_text(DRY.replace(', w_0: 0.1 rad/s', ''), encoding='utf-8')
    with pytest.raises(lg.LgHuskyError, match=r"motor\.yaml: .*'w_0'.* has no value"):
        lg.graph(path).right_hand_side()
    with pytest.raises(lg.LgHuskyError, match="unknown parameter 'T_9'"):
        lg.graph(DRY).right_hand_side(T_9=1.0)
