# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A base that swings on its tyres, against equations that are written here once more."""

from __future__ import annotations

from collections.abc import Callable
import math

from lg_husky_sim.husky.edits.network import scrubbing
from lg_husky_sim.husky.effects import catalogue, Effect
from lg_husky_sim.husky.model import Structure
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.simulation.events import trajectory
import numpy as np
import pytest
from scipy.integrate import solve_ivp

Maker = Callable[..., Plant]
P = dict(load_model().parameters.items())
STOP, END = 1.5, 3.0
PIVOT = TimeSeries(np.array([0.0, STOP]), np.array([[0.0, 0.6], [0.0, 0.0]]), ('forward', 'yaw'))
WINDUP = {'windup_stiffness': 1500.0, 'windup_damping': 2.0, 'patch_inertia': 0.03}
DRY = {'yaw_coulomb_moment': 8.0, 'yaw_coulomb_rate': 0.03}


def rates(time: float, s: FloatArray, scrub: float, moment: float) -> FloatArray:
    """
    Return the rates of turning on the spot on tyres that wind up.

    Both sides mirror each other: state (right wheel, base, contact patches [rad/s], right current
    [A], angle by which the tyres are wound up [rad], heading [rad]).
    """
    wheel, base, patch, current, wound, _ = s
    lever, motor = 0.5 * P['track'] / P['wheel_radius'], P['torque_constant'] * P['gear_ratio']
    volts = P['supply_voltage'] * P['command_gain'] * P['turn_ratio'] * 0.6 * (time < STOP)
    slip = 2.0 * P['wheel_damping'] * (wheel - lever * base)
    carcass = (WINDUP['windup_stiffness'] * wound
               + WINDUP['windup_damping'] * (base - patch))
    dry = moment * math.tanh(patch / DRY['yaw_coulomb_rate'])
    return np.array([
        (motor * current - slip) / P['wheel_inertia'],
        (2.0 * lever * slip - carcass) / P['yaw_inertia'],
        (carcass - scrub * patch - dry) / WINDUP['patch_inertia'],
        (volts - P['motor_resistance'] * current - motor * wheel) / P['motor_inductance'],
        base - patch, base])


def reference(times: FloatArray, scrub: float, moment: float) -> FloatArray:
    """Return wheel rate, yaw rate and heading by Radau, which stops where the command does."""
    seen, state = [], np.zeros(6)
    for begin, end in ((0.0, STOP), (STOP, END)):
        inside = times[(times > begin) & (times <= end)]
        found = solve_ivp(rates, (begin + 1e-12, end), state, 'Radau', inside,
                          args=(scrub, moment), rtol=1e-9, atol=1e-12)
        seen.append(found.y[[0, 1, 5]])
        state = found.y[:, -1]
    return np.hstack(seen).T


def swings(times: FloatArray, rate: FloatArray) -> tuple[float, float, int]:
    """Return frequency [rad/s], decay [1/s] and number of swings of a rate after the stop."""
    ends = np.flatnonzero(np.diff(np.sign(np.diff(rate)))) + 1
    ends = ends[(times[ends] > STOP + 0.05) & (np.abs(rate[ends]) > 1e-4)]
    if ends.size < 3:
        return 0.0, 0.0, ends.size
    half = np.diff(times[ends]).mean()
    decay = -np.polyfit(times[ends], np.log(np.abs(rate[ends])), 1)[0]
    return math.pi / half, float(decay), ends.size


def test_it_stands_in_the_catalogue() -> None:
    kind = catalogue()['tyre_windup']
    assert (kind.subsystem.value, kind.sides, kind.always_on) == ('rotation', ('none',), True)
    graph = Structure().with_effect(Effect('tyre_windup')).network().graph
    assert scrubbing(graph).name == 'J_patch'
    assert scrubbing(Structure().network().graph).name == 'J_H'


@pytest.mark.parametrize(('scrub', 'moment'), [(P['yaw_damping'], 0.0), (250.0, 0.0),
                                               (P['yaw_damping'], 8.0)])
def test_it_moves_as_its_equations_say(robot: Maker, scrub: float, moment: float) -> None:
    """
    Scrub of tyres that slide, that hold viscously and that hold dry.

    To 20 urad/s where the equations are linear. Where the patches hold dry, to 1 mrad/s, a
    hundredth of the swing: the steps watch wheels and base, not the patches.
    """
    effects = ('tyre_windup', 'yaw_scrub_coulomb') if moment else ('tyre_windup',)
    values = {**WINDUP, 'yaw_damping': scrub, **(DRY if moment else {})}
    times = np.linspace(0.01, END, 300)
    seen = trajectory(robot(*effects, **values), PIVOT, times)
    expected = reference(times, scrub, moment)
    for column, channel in enumerate(('wheel_right', 'yaw_rate', 'heading')):
        np.testing.assert_allclose(seen.column(channel), expected[:, column],
                                   atol=1e-3 if moment else 2e-5)


def test_the_yaw_rate_rings_after_a_turn_on_the_spot_stops(robot: Maker) -> None:
    """With the frequency and the decay of base and wheels on patches that scrub no more."""
    scrub = 250.0
    times = np.arange(0.0, END, 0.001)
    windy = robot('tyre_windup', **WINDUP, yaw_damping=scrub)
    rate = trajectory(windy, PIVOT, times).column('yaw_rate')
    frequency, decay, count = swings(times, rate)
    assert count >= 4
    matrix = np.column_stack([rates(END, column, scrub, 0.0) for column in np.eye(6)[:, :5].T])
    modes = np.linalg.eigvals(matrix[:5])
    (mode,) = [one for one in modes if one.imag > 0.0]
    assert frequency == pytest.approx(mode.imag, rel=0.02)
    assert decay == pytest.approx(-mode.real, rel=0.05)
    # A spring of that size on what turns: the order of magnitude that a person would expect.
    assert mode.imag == pytest.approx(
        math.sqrt(WINDUP['windup_stiffness'] / P['yaw_inertia']), rel=0.25)
    rigid = trajectory(robot(yaw_damping=scrub), PIVOT, times).column('yaw_rate')
    assert swings(times, rigid)[2] == 0


def test_dry_scrub_holds_the_patches_and_the_base_swings_back(robot: Maker) -> None:
    """The heading comes back by what the tyres were wound up."""
    times = np.arange(0.0, END, 0.001)
    both = robot('yaw_scrub_coulomb', 'tyre_windup', **WINDUP, **DRY)
    run = trajectory(both, PIVOT, times)
    stopped = times > STOP
    back = run.column('heading')[stopped].max() - run.column('heading')[-1]
    assert back > 0.2 * DRY['yaw_coulomb_moment'] / WINDUP['windup_stiffness']
    alone = trajectory(robot('yaw_scrub_coulomb', **DRY), PIVOT, times)
    assert np.all(np.diff(alone.column('heading')[stopped]) > -1e-9)


def test_stiff_tyres_are_the_nominal_robot(robot: Maker) -> None:
    stiff = robot('tyre_windup', windup_stiffness=1e6, windup_damping=1000.0,
                  patch_inertia=0.001)
    times = np.arange(0.0, END, 0.01)
    np.testing.assert_allclose(trajectory(stiff, PIVOT, times).column('yaw_rate'),
                               trajectory(robot(), PIVOT, times).column('yaw_rate'), atol=1e-3)


def test_scrub_with_speed_acts_on_the_patches(robot: Maker) -> None:
    """The order in which the effects were found does not matter."""
    drive = TimeSeries(np.zeros(1), np.array([[0.5, 0.5]]), ('forward', 'yaw'))
    times = np.linspace(0.05, 1.0, 20)
    orders = [trajectory(robot(*names, **WINDUP), drive, times).values for names in (
        ('tyre_windup', 'yaw_scrub_speed'), ('yaw_scrub_speed', 'tyre_windup'))]
    np.testing.assert_allclose(orders[0], orders[1], rtol=0, atol=1e-9)
