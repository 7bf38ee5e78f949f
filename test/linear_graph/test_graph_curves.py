# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Answers as a teacher shows them: printed, as tables, and drawn."""

from __future__ import annotations

from typing import Any

import lg_husky_sim as lg
from lg_husky_sim.errors import ParameterError
from matplotlib.figure import Figure
import numpy as np
import pytest

MOTOR = """
name: motor with flywheel
elements:
  V: {is: voltage source, from: a}
  R: {is: resistor, from: a, to: b, value: 0.5 Ω}
  L: {is: inductor, from: b, to: c, value: 2 mH}
  K: {is: transformer, port 1: {domain: electrical, from: c},
      port 2: {domain: rotational, from: d}, value: 0.05 V·s/rad}
  J: {is: inertia, from: d, value: 0.001 kg·m²}
  B: {is: rotary damper, from: d, value: 0.0001 N·m·s/rad}
outputs: [omega(J)]
"""
OSCILLATOR = """
elements:
  F: {is: force source, from: ground, to: m}
  M: {is: mass, from: m, value: 1}
  B: {is: damper, from: m, value: 0.4}
  K: {is: spring, from: m, value: 4}
outputs: [F(K)]
"""


def test_a_transfer_function_in_numbers_is_printed_with_six_digits() -> None:
    assert str(lg.graph(MOTOR).transfer_function(numbers=True)) == '\n'.join([
        'omega(J) over V [(rad/s)/V]',
        '          25000',
        '  ---------------------',
        '   s² + 250.1 s + 1275',
        'DC gain: 19.6078',
        '      value [1/s]  natural frequency [rad/s]  damping ratio  time constant [s]',
        'pole  -244.894                         244.9              1           0.004083',
        'pole  -5.20634                         5.206              1             0.1921'])
    shown = str(lg.Husky().transfer_function('v(M_H)', 'V_S1', numbers=True))
    assert max(len(word) for word in shown.split() if set(word) != {'-'}) < 20


def test_damping_of_a_pair_of_poles() -> None:
    """Natural frequency sqrt(K/M) = 2, damping ratio B/(2 sqrt(K M)) = 0.1."""
    found = lg.graph(OSCILLATOR).transfer_function(numbers=True)
    for row in found.table().rows:
        assert row[2:] == pytest.approx((2.0, 0.1, 5.0))
    assert [row[1] for row in found.table().rows] == ['-0.2 - 1.98997j', '-0.2 + 1.98997j']


def test_other_tools_get_the_same_fraction() -> None:
    found = lg.graph(MOTOR).transfer_function(numbers=True)
    at = 3.0j
    expected = 25000.0 / (at**2 + 250.1 * at + 1275.0)
    assert found(at) == pytest.approx(expected)
    assert found(np.array([at, at])) == pytest.approx([expected, expected])
    assert complex(found.expr.subs('s', at)) == pytest.approx(expected)
    assert found.to_control()(at) == pytest.approx(expected)
    assert (found.to_scipy().num, found.to_scipy().den[-1]) == (25000.0, 1275.0)
    assert found.to_control().output_labels == ['omega(J)']


def test_step_figures_of_an_oscillator_are_those_of_the_formulas() -> None:
    """Overshoot exp(-pi zeta/sqrt(1 - zeta²)) at pi/omega_d."""
    found = lg.graph(OSCILLATOR).step(np.linspace(0.0, 40.0, 40001))
    row: tuple[Any, ...] = found.table().rows[0]
    _, unit, final, rise, settling, overshoot, peak, peak_time = row
    assert (unit, final) == ('N', pytest.approx(1.0))
    assert overshoot == pytest.approx(100.0 * np.exp(-np.pi * 0.1 / np.sqrt(0.99)), rel=1e-6)
    assert peak == pytest.approx(1.0 + overshoot / 100.0)
    assert peak_time == pytest.approx(np.pi / (2.0 * np.sqrt(0.99)), abs=1e-3)
    t = found.times
    wave = 1.0 - np.exp(-0.2 * t) * (np.cos(1.98997487 * t) + 0.2 / 1.98997487 * np.sin(
        1.98997487 * t))
    np.testing.assert_allclose(found.column('F(K)'), wave, atol=1e-8)
    assert settling == pytest.approx(t[np.flatnonzero(abs(wave - 1.0) > 0.02)[-1]], abs=2e-3)
    assert rise == pytest.approx(t[np.argmax(wave >= 0.9)] - t[np.argmax(wave >= 0.1)], abs=2e-3)


def test_what_does_not_settle_has_no_final_value() -> None:
    found = lg.graph(OSCILLATOR.replace('value: 0.4', 'value: 0')).step()
    assert found.table().rows[0][2:6] == (None, None, None, None)
    assert found.times[-1] == pytest.approx(20.0)       # five periods of pi, and a round number
    short = lg.graph(MOTOR).step([0.0, 0.01, 0.02])
    assert short.table().rows[0][2] == pytest.approx(19.6078, rel=1e-5)
    assert short.table().rows[0][6:] == (None, None)    # it only rises


def test_times_and_rates_by_default_show_all_of_it() -> None:
    husky = lg.Husky()
    step = husky.step(source='V_S1')
    assert step.times[-1] == pytest.approx(2.0)         # slowest time constant 0.28 s
    assert step.times[1] < 1.0 / 1664.0
    bode = husky.bode(output='v(M_H)', source='V_S1')
    assert (bode.rates[0], bode.rates[-1]) == (pytest.approx(0.1), pytest.approx(1e5))
    gain, phase = bode
    assert (gain is not phase, gain.shape) == (True, phase.shape)
    assert phase[-1] == pytest.approx(-270.0, abs=2.0)  # three poles


def test_one_output_of_several_or_none_of_the_list() -> None:
    husky = lg.Husky()
    assert husky.step([0.0, 0.1], 'v(M_H)', 'V_S1').names == ('v(M_H)',)
    current = husky.step(output='i(L_1)', source='V_S1')
    assert (current.names, current.units) == (('i(L_1)',), ('A',))
    assert current.table().rows[0][2] == pytest.approx(
        husky.transfer_function('i(L_1)', 'V_S1', numbers=True).dc_gain)


def test_the_phase_falls_at_the_resonance_of_what_is_not_damped() -> None:
    """Whatever sign the zero imaginary part of the response has."""
    undamped = OSCILLATOR.replace('value: 0.4', 'value: 0')
    assert lg.graph(undamped).bode([0.1, 1.9, 2.1, 100.0]).phase.tolist() == [0, 0, -180, -180]
    assert lg.graph(undamped).bode([100.0, 200.0]).phase.tolist() == [-180, -180]
    # the speed leads the spring's force by 90 degrees, and a coarse grid loses no turn
    speed = lg.graph(undamped).bode([0.1, 100.0], 'v(M)').phase
    assert speed.tolist() == [90, -90]
    right = lg.Husky().bode([0.1, 1e5], 'omega(J_RW)', 'V_S1')
    assert right.phase[-1] == pytest.approx(-540.0, abs=3.0)


def test_the_phase_of_many_states_is_that_of_the_response() -> None:
    husky = lg.Husky()
    for output in ('omega(J_LW)', 'omega(J_H)', 'i(L_1)'):
        found = husky.bode(output=output, source='V_S1')
        turns = (found.phase - np.rad2deg(np.angle(found.values))) / 360.0
        np.testing.assert_allclose(turns, np.rint(turns), atol=1e-9)
        assert np.abs(np.diff(found.phase)).max() < 45.0


def test_the_bandwidth_of_a_low_pass() -> None:
    graph = lg.graph("""
        elements:
          V_s: {is: voltage source, from: a}
          R: {is: resistor, from: a, to: b, value: 2}
          C: {is: capacitor, from: b, value: 0.05}
        outputs: [V(C)]
        """)
    rows = {row[0]: row[1:] for row in graph.bode(np.geomspace(1e-3, 1e3, 2000)).table().rows}
    rate, gain, phase = rows['3 dB below rest']
    assert rate == pytest.approx(10.0 * np.sqrt(10.0**0.3 - 1.0), rel=1e-4)
    assert (gain, phase) == (pytest.approx(-3.0, abs=1e-3), pytest.approx(-44.93, abs=0.02))


def axes(rows: int) -> Any:
    return Figure().subplots(rows, 1, squeeze=False)[:, 0]


def test_a_step_is_drawn_with_units_into_given_axes() -> None:
    drawn = axes(4)
    husky = lg.Husky()
    assert list(husky.step(source='V_S1').plot(drawn)) == list(drawn)
    assert [axis.get_ylabel() for axis in drawn] == [
        'omega(J_LW) [rad/s]', 'omega(J_RW) [rad/s]', 'v(M_H) [m/s]', 'omega(J_H) [rad/s]']
    assert (drawn[0].get_title(), drawn[3].get_xlabel()) == ('Step of V_S1 by 1 V', 'time [s]')
    with pytest.raises(ParameterError, match='1 axes given; a step response of 4 outputs is'):
        husky.step(source='V_S1').plot(drawn[0])
    one = axes(1)[0]
    response = lg.graph(MOTOR).step()
    response.plot(one, label='J')
    lg.graph(MOTOR).step(response.times, J=0.002).plot(one, label='2 J')
    assert [text.get_text() for text in one.get_legend().get_texts()] == ['J', '2 J']
    np.testing.assert_allclose(one.lines[0].get_ydata(), response.values[:, 0])


def test_bode_is_drawn_over_a_logarithmic_frequency() -> None:
    drawn = axes(2)
    bode = lg.graph(MOTOR).bode()
    bode.plot(drawn)
    assert [axis.get_xscale() for axis in drawn] == ['log', 'log']
    assert [axis.get_ylabel() for axis in drawn] == ['gain [dB of (rad/s)/V]', 'phase [deg]']
    assert drawn[1].get_xlabel() == 'angular frequency [rad/s]'
    np.testing.assert_allclose(drawn[0].lines[0].get_ydata(), bode.gain)
    np.testing.assert_allclose(drawn[1].lines[0].get_ydata(), bode.phase)
    with pytest.raises(ParameterError, match='1 axes given; a frequency response is drawn into 2'):
        bode.plot(drawn[:1])
    constant = axes(2)      # rounding of a constant phase is no signal
    lg.graph(OSCILLATOR).bode([0.001, 0.0011]).plot(constant)
    assert np.diff(constant[1].get_ylim()) >= 45.0
    assert constant[0].get_ylabel() == 'gain [dB]'      # newtons over newtons


def test_an_output_that_nothing_reaches_is_zero_and_not_rounding() -> None:
    graph = lg.graph("""
        elements:
          V_1: {is: voltage source, from: a}
          R_1: {is: resistor, from: a, value: 3}
          V_2: {is: voltage source, from: d}
          R_2: {is: resistor, from: d, to: e, value: 2}
          C_2: {is: capacitor, from: e, value: 3}
        outputs: [V(C_2)]
        """)
    found = graph.bode([0.1, 1.0], source='V_1')
    assert (found.values.tolist(), found.gain.tolist()) == ([0.0, 0.0], [-np.inf, -np.inf])
    found.plot(axes(2))
    graph.step(source='V_1').plot(axes(1))
    assert graph.step(source='V_1').table().rows[0][2:6] == (0.0, None, None, None)


def test_two_different_curves_share_no_title() -> None:
    drawn = axes(2)
    husky = lg.Husky()
    for side in ('J_LW', 'J_RW'):
        husky.bode(output=f'omega({side})', source='V_S1').plot(drawn, label=side)
    assert drawn[0].get_title() == ''
    assert len(drawn[0].get_legend().get_texts()) == 2


def test_notebooks_and_pandas_show_tables() -> None:
    graph = lg.graph(MOTOR)
    fraction, step, bode = graph.transfer_function(numbers=True), graph.step(), graph.bode()
    for result, words in ((fraction, 'damping ratio'), (step, 'overshoot'), (bode, 'gain [dB]')):
        html = result._repr_html_()
        assert html.startswith('<div class="lg-husky"><h4>')
        assert words in html
        assert words in str(result)
    assert 's² + 250.1 s + 1275</div>' in fraction._repr_html_()
    assert list(step.to_pandas().columns) == ['omega(J)']
    assert step.to_pandas().index.name == 'time'
    assert list(bode.to_pandas().columns) == ['gain [dB]', 'phase [deg]']
    assert fraction.to_pandas().shape == (2, 5)
    np.testing.assert_array_equal(np.asarray(step), step.values)
    with pytest.raises(ParameterError, match=r"no output 'v\(M\)'; there is omega\(J\)"):
        step.column('v(M)')
    with pytest.raises(ValueError, match='read-only'):
        step.values[0] = 1.0
