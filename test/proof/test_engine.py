# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The Husky of each rigid-body engine drives, turns the right way, and feels hidden effects."""

from __future__ import annotations

from lg_husky_sim.proof import world
from lg_husky_sim.proof.engine import integrate_engine
from lg_husky_sim.proof.integrate import COLUMNS, Gate, smooth_floor
import numpy as np
from numpy.typing import NDArray
import pytest

Vector = NDArray[np.float64]

MODULES = {'mujoco': 'mujoco', 'bullet': 'pybullet'}


@pytest.fixture(params=sorted(MODULES))
def engine(request: pytest.FixtureRequest) -> str:
    pytest.importorskip(MODULES[request.param])
    return str(request.param)


def motion(engine: str, left: float, right: float, changes: dict[str, float] | None = None,
           gate: Gate | None = None, heading: float = 0.0) -> dict[str, Vector]:
    plain = {**world.nominal(), 'tyre': 1.0}
    table = integrate_engine(
        engine, world.vector(plain), world.vector({**plain, **(changes or {})}), gate or Gate(),
        np.array([0.3]), np.array([[left, right]]), smooth_floor(), 2.5, (1.0, 2.0, heading))
    return {name: table[:, k] for k, name in enumerate(COLUMNS)}


def test_it_rolls_without_slip_straight_on(engine: str) -> None:
    found = motion(engine, 12.0, 12.0, heading=0.5)
    assert found['forward'][-1] == pytest.approx(0.1651 * found['wheel_left'][-1], rel=0.02)
    assert found['forward'][-1] == pytest.approx(
        12.0 / world.nominal()['torque_constant'] * 0.1651, rel=0.03)
    assert found['heading'][-1] == pytest.approx(0.5, abs=0.01)
    gone = np.hypot(found['x'][-1] - 1.0, found['y'][-1] - 2.0)
    assert gone == pytest.approx(0.1651 * found['angle_left'][-1], rel=0.03)
    assert abs(found['forward'][:280]).max() < 0.01


def test_more_voltage_on_the_right_turns_left(engine: str) -> None:
    found = motion(engine, 4.0, 14.0)
    assert found['heading'][-1] > 0.1
    assert found['current_right'][-1] > found['current_left'][-1]


@pytest.mark.parametrize(('changes', 'channel', 'least'), [
    ({'rolling': 80.0}, 'current_left', 0.3), ({'friction_left': 8.0}, 'current_left', 0.5),
    ({'gravity_x': -0.8}, 'current_left', 0.2), ({'clip': 8.0}, 'forward', 0.1),
    ({'battery_resistance': 0.5}, 'bus', 0.5), ({'radius_left': 0.15}, 'wheel_left', 0.02),
    ({'pull': 60.0}, 'heading', 0.02), ({'mass': 90.0}, 'forward', 0.02),
    ({'current_limit': 3.0}, 'forward', 0.1)])
def test_a_change_of_the_robot_is_felt(engine: str, changes: dict[str, float], channel: str,
                                       least: float) -> None:
    plain, changed = motion(engine, 12.0, 12.0), motion(engine, 12.0, 12.0, changes)
    assert np.abs(changed[channel] - plain[channel]).max() > least


def test_a_source_that_resists_more_than_the_windings_is_stable(engine: str) -> None:
    """The bus is what the battery leaves of its EMF under the currents that the bus drives."""
    resistance = 2.0 * world.nominal()['resistance']
    plain = motion(engine, 20.0, 20.0)
    weak = motion(engine, 20.0, 20.0, {'battery_resistance': resistance})
    assert 0.1 < weak['forward'].max() < plain['forward'].max()
    assert np.count_nonzero(np.abs(np.diff(weak['bus'])) > 1.0) < 10
    late = slice(700, None)
    drawn = 20.0 / 24.0 * (weak['current_left'] + weak['current_right'])[late]
    left = weak['bus'][late] + resistance * drawn
    assert left == pytest.approx(np.full(left.shape, left[-1]), rel=0.02)


def test_less_adhesion_at_a_place_only_shows_there(engine: str) -> None:
    plain = motion(engine, 4.0, 14.0)
    icy = motion(engine, 4.0, 14.0, {'tyre_friction': 0.15}, Gate('place', 1.4))
    before = np.arange(plain['x'].size) < np.argmax(plain['x'] > 1.28)
    assert np.abs(icy['yaw_rate'] - plain['yaw_rate'])[before].max() < 1e-9
    assert np.abs(icy['yaw_rate'] - plain['yaw_rate'])[~before].max() > 0.02
