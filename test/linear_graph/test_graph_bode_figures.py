# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Largest gain and bandwidth are those of the response, not of the frequencies asked for."""

from __future__ import annotations

from typing import Any

import lg_husky_sim as lg
from matplotlib.figure import Figure
import numpy as np
import pytest


def oscillator(mass: float, damping: float, stiffness: float) -> lg.Graph:
    return lg.graph(f"""
        elements:
          F: {{is: force source, from: ground, to: m}}
          M: {{is: mass, from: m, value: {mass}}}
          B: {{is: damper, from: m, value: {damping}}}
          K: {{is: spring, from: m, value: {stiffness}}}
        outputs: [v(M), F(K), F(M)]
        """)


def rows(found: Any) -> dict[str, tuple[Any, ...]]:
    return {row[0]: row[1:] for row in found.table().rows}


def test_a_narrow_resonance_is_in_table_and_picture() -> None:
    """The speed is 1/B at sqrt(K/M)."""
    bode = oscillator(1.0, 0.00548, 1.8769).bode(output='v(M)')
    rate, gain, phase = rows(bode)['largest gain']
    assert (rate, gain) == (pytest.approx(1.37), pytest.approx(-20.0 * np.log10(0.00548)))
    assert phase == pytest.approx(0.0, abs=1e-6)
    axes = Figure().subplots(2, 1)
    bode.plot(axes)
    assert axes[0].lines[0].get_ydata().max() == pytest.approx(gain, abs=0.01)


def test_the_resonance_of_a_force_is_beside_that_of_the_speed() -> None:
    """1/(2 zeta sqrt(1 - zeta²)) at omega sqrt(1 - 2 zeta²), for frequencies of one's own, too."""
    for damping in (2e-4, 0.6):
        zeta = damping / 2.0
        for rates in (None, [0.1, 10.0]):
            bode = oscillator(1.0, damping, 1.0).bode(rates, 'F(K)')
            rate, gain, _ = rows(bode)['largest gain']
            assert rate == pytest.approx(np.sqrt(1.0 - 2.0 * zeta**2))
            assert gain == pytest.approx(-20.0 * np.log10(2.0 * zeta * np.sqrt(1.0 - zeta**2)))


def test_what_nothing_damps_has_an_infinite_gain() -> None:
    for name in ('F(K)', 'v(M)'):
        bode = oscillator(2.0, 0.0, 8.0).bode(output=name)
        assert rows(bode)['largest gain'][:2] == (pytest.approx(2.0), 'infinite')
        assert np.isfinite(bode.gain).all()
        assert 'largest gain' in str(bode)
    # a zero on the axis is no peak: F(M) = s²/(s² + 4) has one at 0
    assert rows(oscillator(2.0, 0.0, 8.0).bode(output='F(M)'))['largest gain'][1] == 'infinite'


def test_the_bandwidth_is_that_below_the_gain_at_rest_if_there_is_one() -> None:
    bode = oscillator(1.0, 20.0, 1.0).bode([10.0, 0.01], 'F(K)')
    rate, gain, _ = rows(bode)['3 dB below rest']
    slow = 10.0 - np.sqrt(99.0)     # the other pole is 400 times as fast
    assert rate == pytest.approx(slow * np.sqrt(10.0**0.3 - 1.0), rel=1e-4)
    assert gain == pytest.approx(-3.0)
    assert '3 dB below rest' not in rows(oscillator(1.0, 20.0, 1.0).bode(output='v(M)'))
    integrator = lg.graph("""
        elements:
          F: {is: force source, from: ground, to: m}
          M: {is: mass, from: m, value: 2}
        outputs: [v(M)]
        """).bode()
    assert list(rows(integrator)) == ['lowest frequency', 'highest frequency']


def test_a_zero_on_the_axis_has_no_negative_damping() -> None:
    fraction = oscillator(1.0, 0.0, 1.0).transfer_function('F(M)', numbers=True)
    assert all(str(row[3]) != '-0.0' for row in fraction.table().rows)
