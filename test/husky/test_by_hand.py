# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Robots that a person describes: numbers, what is known of them, and bounds that follow."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

from click.testing import CliRunner
import lg_husky_sim as lg
from lg_husky_sim.cli.main import cli
from lg_husky_sim.errors import ModelFileError, ParameterError, SettingsError
from lg_husky_sim.husky.by_hand import setting
from lg_husky_sim.husky.model_file import load_model, nominal_of
from lg_husky_sim.resources import config_path
from lg_husky_sim.yaml_files import read_yaml
import numpy as np
import pytest

#: A robot of 6 kg at 12 V and one of 280 kg at 48 V.
SMALL: dict[str, Any] = {
    'mass': 6.0, 'yaw_inertia': 0.08, 'wheel_radius': 0.05, 'track': 0.24, 'wheelbase': 0.18,
    'wheel_inertia': 8e-4, 'motor_resistance': 1.8, 'motor_inductance': 1e-3,
    'torque_constant': 0.02, 'gear_ratio': 30.0, 'supply_voltage': 12.0,
    'wheel_damping': 0.02, 'yaw_damping': 0.32, 'command_gain': 1.0, 'turn_ratio': 0.22}
LARGE: dict[str, Any] = {
    'mass': 280.0, 'yaw_inertia': 45.0, 'wheel_radius': 0.3, 'track': 1.1, 'wheelbase': 0.9,
    'wheel_inertia': 3.5, 'motor_resistance': 0.12, 'motor_inductance': 2e-4,
    'torque_constant': 0.16, 'gear_ratio': 30.0, 'supply_voltage': 48.0,
    'wheel_damping': 130.0, 'yaw_damping': 150.0, 'command_gain': 0.2, 'turn_ratio': 1.0}


@pytest.mark.parametrize('numbers', [SMALL, LARGE], ids=['6 kg', '280 kg'])
def test_robots_of_6_and_280_kg_can_be_described(
        tmp_path: Path, numbers: dict[str, Any]) -> None:
    robot = lg.Husky(about='ours', **numbers)
    for entry in robot.parameters.entries:
        assert entry.lower <= entry.value <= entry.upper
        if entry.name in numbers:
            assert (entry.value, entry.source) == (numbers[entry.name], 'set by hand')
    robot.save(tmp_path / 'robot.yaml')
    assert lg.Husky(tmp_path / 'robot.yaml').model == robot.model
    assert 'Husky A200' not in (tmp_path / 'robot.yaml').read_text(encoding='utf-8').split(
        'parameters:')[0]


@pytest.mark.parametrize(('numbers', 'message'), [
    ({'mass': -3.0}, 'mass = -3 kg is not positive'),
    ({'mass': 0.0}, 'mass = 0 kg is not positive'),
    ({'belt_damping': -1.0}, 'belt_damping = -1 N·m·s/rad is negative'),
    ({'mass': lg.Number(-3.0, lower=-9.0)}, 'mass = -3 kg is not positive'),
    ({'wheel_radius': 98.0}, 'wheel_radius = 98 m is above its upper bound 2 by more than a '
     'factor of 10; if it is right, give it a bound of its own'),
    ({'mass': 0.01}, 'mass = 0.01 kg is below its lower bound 1 by more than a factor of 10'),
    ({**SMALL, 'mass': 6000.0}, 'wheel_damping = 0.02 N·m·s/rad is below its lower bound 0.264 '
     "(in proportion to 124 times the Husky's mass and 0.357 times the Husky's length) by more "
     'than a factor of 10; if all of this is right, give it a bound of its own'),
    ({'mass': 'heavy'}, "mass = 'heavy' is not a number"),
    ({'mass': True}, 'mass = True is not a number'),
    ({'mass': float('nan')}, 'mass = nan kg is not a finite number'),
    ({'mass': 10 ** 400}, 'mass = inf kg is not a finite number'),
    ({'mas': 3.0}, "unknown parameter 'mas'; did you mean mass?"),
    ({'mass': lg.Number(30.0, upper=20.0)}, 'mass = 30 kg is above its upper bound 20'),
    ({'mass': lg.Number(30.0, lower=40.0)}, 'mass = 30 kg is below its lower bound 40'),
    ({'about': 3.0}, 'about = 3.0 is not a text'),
])
def test_nonsense_is_refused_in_a_line(numbers: dict[str, Any], message: str) -> None:
    with pytest.raises(ParameterError) as caught:
        lg.Husky(**numbers)
    assert str(caught.value).startswith(message)
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize(('given', 'message'), [
    ({'tolerance': -0.1}, 'tolerance = -0.1 is negative'),
    ({'upper': float('inf')}, 'upper = inf is not a finite number'),
    ({'value': '17'}, "value = '17' is not a number"),
    ({'free': 'yes'}, "free = 'yes' is neither True nor False"),
    ({'source': 3}, 'source = 3 is not a text'),
])
def test_what_is_known_of_a_number_is_checked(given: dict[str, Any], message: str) -> None:
    with pytest.raises(ParameterError) as caught:
        lg.Number(**given)
    assert str(caught.value) == message


def test_a_number_says_what_is_known_of_it_and_the_rest_stays(tmp_path: Path) -> None:
    nominal, float32 = load_model().parameters, cast('float', np.float32(0.01))
    robot = lg.Husky(
        mass=lg.Number(17.0, tolerance=0.02, lower=15.0, upper=20.0, source='scales', free=True),
        motor_resistance=lg.Number(tolerance=0.15), wheel_inertia=lg.Number(float32, source='CAD'),
        about='Clearpath Jackal of our lab')
    robot.save(tmp_path / 'jackal.yaml')
    again = lg.Husky(tmp_path / 'jackal.yaml')
    assert again.model.about == 'Clearpath Jackal of our lab'
    mass, resistance = (again.parameters.entry(name) for name in ('mass', 'motor_resistance'))
    assert (mass.value, mass.tolerance, mass.lower, mass.upper, mass.source, mass.free) == (
        17.0, 0.02, 15.0, 20.0, 'scales', True)
    assert (resistance.value, resistance.tolerance) == (0.46, 0.15)
    assert resistance.source == nominal.entry('motor_resistance').source
    assert again.parameters['wheel_inertia'] == pytest.approx(0.01)


def test_bounds_stay_in_proportion_and_those_of_the_same_robot_as_they_are() -> None:
    nominal = load_model().parameters
    same = lg.Husky(command_gain=0.9, wheel_damping=2.0).parameters
    assert [(e.lower, e.upper) for e in same.entries] == [
        (e.lower, e.upper) for e in nominal.entries]
    heavy = lg.Husky(mass=4.0 * nominal['mass'], supply_voltage=48.0).parameters
    for name, factor in (('wheel_damping', 4.0), ('motor_resistance', 1.0), ('turn_ratio', 1.0),
                         ('torque_constant', 2.0), ('command_gain', 1.0), ('mass', 1.0)):
        here, there = heavy.entry(name), nominal.entry(name)
        assert (here.lower, here.upper) == (factor * there.lower, factor * there.upper), name


@pytest.mark.parametrize(('name', 'value'), [
    ('wheel_damping', 120.0), ('command_gain', 0.03), ('supply_voltage', 0.5)])
def test_a_value_a_little_beyond_moves_its_bound(name: str, value: float) -> None:
    entry = lg.Husky(None, **{name: value}).parameters.entry(name)
    nominal = load_model().parameters.entry(name)
    if value > nominal.upper:
        assert (entry.lower, entry.upper) == (nominal.lower, setting('reach') * value)
    else:
        assert (entry.lower, entry.upper) == (value / setting('reach'), nominal.upper)


def test_a_bound_of_its_own_allows_what_else_is_a_slip() -> None:
    entry = lg.Husky(wheel_radius=lg.Number(98.0, upper=200.0)).parameters.entry('wheel_radius')
    assert (entry.value, entry.upper) == (98.0, 200.0)


def test_a_model_says_where_it_comes_from() -> None:
    husky = lg.Husky()
    paper = "Clearpath Husky A200 with the paper's parameters"
    assert husky.model.about == paper
    assert lg.Husky(mass=62.0).model.about == f'{paper}; mass set by hand'
    assert lg.Husky(mass=62.0).replacing(mass=63.0, wheel_radius=0.165).model.about == (
        f'{paper}; wheel_radius, mass set by hand')
    other = lg.Husky(**SMALL)
    assert other.model.about == ('robot of 6 kg, wheel radius 0.05 m, track 0.24 m; '
                                 '15 parameters set by hand')
    assert repr(other) == f'<Husky {other.model.about}>'
    assert other.replacing(about='ours', mass=6.5).model.about == 'ours'
    assert lg.Husky(other.replacing(about='ours')).replacing(wheel_damping=0.1).model.about == (
        'ours; wheel_damping set by hand')


def test_sizes_of_effects_are_listed_for_a_robot(tmp_path: Path) -> None:
    heavy = lg.Husky(mass=10.0 * 48.39)
    heavy.save(tmp_path / 'heavy.yaml')
    usual, own = lg.list_effects('payload'), lg.list_effects('payload', heavy)
    assert own.rows[0][2] == pytest.approx(10.0 * cast('float', usual.rows[0][2]))
    printed = CliRunner().invoke(
        cli, ['effects', 'payload', '--robot', str(tmp_path / 'heavy.yaml')])
    assert printed.output == f'{own}\n'
    assert lg.list_effects('payload', lg.Husky()).rows == usual.rows


@pytest.mark.parametrize(('section', 'name', 'unit'), [
    ('given', 'reach', '1'), ('given', 'other_robot', '1'), ('given', 'missed_speed', '1'),
    ('together', 'radius_most', '1'), ('together', 'inertia_least', '1'),
    ('together', 'inertia_most', '1'), ('together', 'density_least', 'kg/m³'),
    ('together', 'density_most', 'kg/m³')])
def test_numbers_of_parameters_have_unit_meaning_and_source(
        section: str, name: str, unit: str) -> None:
    entry = read_yaml(config_path('parameters.yaml'), SettingsError)[section][name]
    assert setting(name) == entry['value']
    assert entry['unit'] == unit
    assert len(entry['meaning']) > 20
    assert entry['source']


#: A Jackal as its numbers should be: within all bounds of single parameters in other units, too.
JACKAL: dict[str, Any] = {'mass': 17.0, 'yaw_inertia': 0.43, 'wheel_radius': 0.098,
                          'track': 0.376, 'wheelbase': 0.262}
SLIPS: dict[str, tuple[dict[str, Any], str]] = {
    'radius in cm': ({'wheel_radius': 9.8}, 'wheel_radius = 9.8 m and track = 0.5708 m are no '
                     'robot together: wheel_radius / track = 17.2 is above 1; write them in SI'),
    'track in cm': ({'track': 37.6}, '(track² + wheelbase²)) = 4.47e-05 is below 0.002'),
    'mass in g': ({'mass': 17000.0}, '(track² + wheelbase²)) = 0.000306 is below 0.002'),
    'inertia': ({'mass': 17.0, 'yaw_inertia': 430.0},
                '(track² + wheelbase²)) = 43 is above 2.5'),
    'lengths in cm': ({**JACKAL, 'wheel_radius': 9.8, 'track': 37.6, 'wheelbase': 26.2,
                       'yaw_inertia': 4300.0, 'wheel_inertia': 100.0, 'wheel_damping': 9.0,
                       'yaw_damping': 1000.0},
                      'mass / (track wheelbase wheel_radius) = 0.00176 kg/m³ is below 1 kg/m³')}


@pytest.mark.parametrize('name', SLIPS)
def test_sizes_that_no_robot_has_together_are_refused(name: str) -> None:
    numbers, words = SLIPS[name]
    with pytest.raises(ParameterError) as caught:
        lg.Husky(**numbers)
    assert words in str(caught.value)
    assert '\n' not in str(caught.value)


def test_sizes_that_are_meant_have_a_bound_of_their_own_and_are_read_again(tmp_path: Path) -> None:
    assert lg.Husky(**JACKAL).parameters['track'] == 0.376
    odd = lg.Husky(mass=17.0, yaw_inertia=lg.Number(430.0, upper=900.0))
    odd.save(tmp_path / 'odd.yaml')
    assert lg.Husky(tmp_path / 'odd.yaml').replacing(wheel_damping=2.0).parameters[
        'yaw_inertia'] == 430.0


def test_a_file_by_hand_in_centimetres_is_refused(tmp_path: Path) -> None:
    values = {**lg.Husky().parameters, **SMALL}
    lines = [f'  {name}: {value}' for name, value in values.items()]
    text = '\n'.join(['schema: lg_husky_sim/model/1', 'parameters:', *lines, ''])
    (tmp_path / 'small.yaml').write_text(text, encoding='utf-8')
    assert lg.Husky(tmp_path / 'small.yaml').parameters['track'] == 0.24
    (tmp_path / 'small.yaml').write_text(
        text.replace('wheelbase: 0.18', 'wheelbase: 18.0'), encoding='utf-8')
    with pytest.raises(ModelFileError, match=r'wheelbase = 18 m are no robot together'):
        lg.Husky(tmp_path / 'small.yaml')


def test_a_twin_is_compared_with_a_model_of_its_own_robot() -> None:
    """The packaged Husky beside a robot of 6 kg says nothing."""
    husky = lg.Husky(wheel_damping=0.7).with_effect('payload')
    assert nominal_of(husky.model) == load_model()
    small = lg.Husky(about='ours', **SMALL)
    plain = nominal_of(small.with_effect('payload').model)
    assert plain.structure == small.model.structure
    assert plain.parameters['mass'] == 6.0
    assert plain.about == 'ours, without effects'
