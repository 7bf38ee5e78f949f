# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Rise time, settling, overshoot and peak are those of the response, not of the samples."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import lg_husky_sim as lg
from lg_husky_sim.errors import ParameterError, SettingsError
from lg_husky_sim.linear_graph import compile_numeric
from lg_husky_sim.linear_graph.modes import step_figures, step_modes
import numpy as np
import pytest
from scipy.optimize import brentq

EXAMPLES = Path(__file__).resolve().parents[2] / 'examples' / 'linear_graph'
MOTOR = """
elements:
  V: {is: voltage source, from: a}
  R: {is: resistor, from: a, to: b, value: 1}
  L: {is: inductor, from: b, to: c, value: 1 µH}
  K: {is: transformer, port 1: {domain: electrical, from: c},
      port 2: {domain: rotational, from: d}, value: 0.05 V·s/rad}
  J: {is: inertia, from: d, value: 0.01}
  B: {is: rotary damper, from: d, value: 0.0001}
outputs: [i(L), tau(J), omega(J)]
"""
RC = """
elements:
  V: {is: voltage source, from: a}
  R: {is: resistor, from: a, to: b, value: 1}
  C: {is: capacitor, from: b, value: 1 nF}
outputs: [V(C)]
"""


def oscillator(mass: float, damping: float, stiffness: float) -> lg.Graph:
    return lg.graph(f"""
        elements:
          F: {{is: force source, from: ground, to: m}}
          M: {{is: mass, from: m, value: {mass}}}
          B: {{is: damper, from: m, value: {damping}}}
          K: {{is: spring, from: m, value: {stiffness}}}
        outputs: [F(K)]
        """)


def row(found: Any, at: int = 0) -> tuple[Any, ...]:
    return tuple(found.table().rows[at][2:])


def test_a_fast_mode_before_a_slow_one_is_seen() -> None:
    """The current rises to V/R = 1 A in microseconds, and falls to B V/(B R + K²) in seconds."""
    final, rise, settling, overshoot, peak, _ = row(lg.graph(MOTOR).step())
    assert final == pytest.approx(1.0 / 26.0)
    low, high = (-1e-6 * np.log1p(-part / 26.0) for part in (0.1, 0.9))
    assert rise == pytest.approx(high - low, rel=1e-4)
    assert peak == pytest.approx(1.0, rel=1e-5)
    assert overshoot == pytest.approx(2500.0, rel=1e-4)
    # 1/26 + 25/26 exp(-t/tau), tau = J R/(B R + K²)
    assert settling == pytest.approx(0.01 / 0.0026 * np.log(25.0 / 0.02), rel=1e-5)


@pytest.mark.parametrize('damping', [0.4, 2e-4])
def test_light_damping_swings_as_the_formulas_say(damping: float) -> None:
    zeta = damping / 2.0
    swing = np.sqrt(1.0 - zeta**2)

    def wave(t: float) -> float:
        return float(1.0 - np.exp(-zeta * t) * (np.cos(swing * t) + zeta / swing * np.sin(
            swing * t)))

    found = oscillator(1.0, damping, 1.0).step()
    final, rise, settling, overshoot, peak, peak_time = row(found)
    assert final == 1.0
    assert rise == pytest.approx(brentq(lambda t: wave(t) - 0.9, 0.0, 3.0)
                                 - brentq(lambda t: wave(t) - 0.1, 0.0, 3.0))
    assert overshoot == pytest.approx(100.0 * np.exp(-np.pi * zeta / swing))
    assert (peak, peak_time) == (pytest.approx(1.0 + overshoot / 100.0),
                                 pytest.approx(np.pi / swing, rel=1e-6))
    assert abs(wave(settling) - 1.0) == pytest.approx(0.02, rel=1e-6)
    later = settling + np.linspace(1e-6, 100.0, 10_000)
    assert max(abs(wave(t) - 1.0) for t in later) < 0.02
    assert found.times[-1] >= settling


def test_what_swings_on_peaks_at_its_first_peak() -> None:
    found = oscillator(2.0, 0.0, 8.0).step()
    assert row(found)[1:4] == (None, None, None)
    assert row(found)[4:] == (pytest.approx(2.0), pytest.approx(np.pi / 2.0))


def test_a_repeated_pole_is_no_exception() -> None:
    """1 - (1 + t) exp(-t)."""
    _, rise, settling, overshoot, peak, _ = row(oscillator(1.0, 2.0, 1.0).step())

    def at(level: float) -> float:
        return float(brentq(lambda t: 1.0 - (1.0 + t) * np.exp(-t) - level, 0.0, 20.0))

    assert (rise, settling) == (pytest.approx(at(0.9) - at(0.1)), pytest.approx(at(0.98)))
    assert (overshoot, peak) == (0.0, None)


def test_times_of_ones_own_change_no_figure() -> None:
    graph = oscillator(1.0, 0.4, 1.0)
    assert row(graph.step([0.0, 1.0, 2.0])) == row(graph.step())
    assert row(graph.step([0.0, 1.0, 2.0])) != row(graph.step(B=0.5))


def test_samples_too_far_apart_for_a_swing_are_told() -> None:
    graph = oscillator(1.0, 0.4, 1.0)
    assert graph.step([0.0, 3.0]).notes == ''
    assert graph.step([0.0, 4.0]).notes.startswith(
        'The times are too far apart to show the swing at 0.979796 rad/s; the figures do not')


def test_a_final_value_that_cancels_is_zero_and_has_no_parts() -> None:
    found = lg.graph(MOTOR).step(None, 'tau(J)')
    assert row(found)[:4] == (0.0, None, None, None)
    assert row(found)[4] == pytest.approx(0.05, rel=1e-4)
    wall = lg.graph("""
        elements:
          T: {is: temperature source, from: a}
          R_1: {is: thermal resistance, from: a, to: b, value: 0.02}
          C_1: {is: heat capacity, from: b, value: 5e6}
          R_2: {is: thermal resistance, from: b, to: c, value: 0.03}
          C_2: {is: heat capacity, from: c, value: 3e5}
        outputs: [q(R_1)]
        """).step()
    assert row(wall) == (0.0, None, None, None, pytest.approx(50.0), 0.0)


def test_times_by_default_reach_until_all_has_settled() -> None:
    """Six time constants leave 0.25 % of the first value, but 6 % of the last one."""
    found = lg.graph(MOTOR).step()
    assert found.times[-1] >= row(found)[2]
    part = found.column('i(L)') / found.final[0]
    assert abs(part[-1] - 1.0) < 0.02


def test_swings_without_end_are_said() -> None:
    found = oscillator(1.0, 2e-8, 1.0).step()
    assert row(found)[:3] == (1.0, pytest.approx(1.01968, rel=1e-4), None)
    assert 'F(K): too many swings until the end for all figures' in str(found)


def test_poles_far_apart_give_figures() -> None:
    """A time constant of 1e-9 s before one of 1e4 s."""
    found = lg.graph("""
        elements:
          V: {is: voltage source, from: a}
          R: {is: resistor, from: a, to: b, value: 1}
          C: {is: capacitor, from: b, value: 1e-9}
          R_2: {is: resistor, from: b, to: c, value: 1e7}
          C_2: {is: capacitor, from: c, value: 1e-3}
        outputs: [V(C), V(C_2)]
        """).step()
    assert row(found)[1] == pytest.approx(1e-9 * np.log(9.0), rel=1e-4)
    assert row(found, 1)[1] == pytest.approx(1e4 * np.log(9.0), rel=1e-4)


def test_unequal_times_of_a_fast_system_are_refused() -> None:
    with pytest.raises(ParameterError, match='equally spaced from 0'):
        lg.graph(RC).step([0.0, 1e-9, 5e-9, 6e-9])
    np.testing.assert_allclose(lg.graph(RC).step([0.0, 1e-9]).values[:, 0],
                               [0.0, 1.0 - np.exp(-1.0)])


@pytest.mark.parametrize('name', sorted(path.stem for path in EXAMPLES.glob('*.yaml')))
def test_figures_of_examples_agree_with_their_samples(name: str) -> None:
    """Modes from exact poles and zeros against the matrix exponential."""
    graph = lg.graph(EXAMPLES / f'{name}.yaml')
    needed = compile_numeric(graph.graph, graph.outputs, chained=True).parameters
    missing = {name: 1.0 for name in needed if name not in graph.values}
    for source in graph.inputs:
        for output in graph.outputs:
            try:
                found = graph.step(output=output, source=source, **missing)
            except SettingsError:       # it begins with an impulse
                continue
            final, rise, settling, _, peak, peak_time = row(found)
            values, times = found.values[:, 0], found.times
            if peak is not None:
                assert abs(peak) >= np.abs(values).max() * (1.0 - 1e-6)
                assert np.interp(peak_time, times, values) == pytest.approx(peak, rel=0.02)
            if rise is not None and final:
                assert np.abs(values[times >= settling] / final - 1.0).max() < 0.0201
                assert rise <= times[np.argmax(values / final >= 0.9)]


def test_what_grows_is_shown_until_it_has_grown() -> None:
    """Not for time constants of a slow pole, in which exp(t) overflows."""
    found = lg.graph("""
        parameters: {g: 2 S}
        elements:
          V: {is: voltage source, from: a}
          R: {is: resistor, from: a, to: b, value: 1}
          C: {is: capacitor, from: b, value: 1e-3}
          I: {is: current source, from: ground, to: b, law: proportional, of: [V(C)],
              parameters: [g]}
          R_2: {is: resistor, from: b, to: c, value: 1000}
          C_2: {is: capacitor, from: c, value: 1}
        outputs: [V(C)]
        """).step()
    assert np.isfinite(found.values).all()
    assert 1e-3 * 6.0 <= found.times[-1] < 1e-3 * 10.0
    assert [one is None or np.isnan(one) for one in row(found)] == [True] * 6


def test_a_fast_mode_beside_what_swings_on_is_followed_while_it_lasts() -> None:
    poles = np.array([1j, -1j, 2.5j, -2.5j, -1e5])
    found = step_figures(step_modes(1.0, np.array([]), poles), float('nan'), 40.0)
    assert found.complete
    t = np.linspace(0.0, 40.0, 400_001)
    own = step_modes(1.0, np.array([]), poles)(t)
    assert found.peak == pytest.approx(own.max(), rel=1e-7)
