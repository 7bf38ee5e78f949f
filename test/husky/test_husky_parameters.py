# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Parameters: Table I and II, bounds and the messages that name them."""

from __future__ import annotations

import dataclasses
import math

from lg_husky_sim.errors import ParameterError
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.model_file import apply_settings, load_model, parse_settings
from lg_husky_sim.husky.parameters import Parameter, Parameters
import pytest

TABLES = {
    'motor_resistance': (0.46, 'Ω'), 'motor_inductance': (0.22e-3, 'H'),
    'torque_constant': (0.044488, 'N·m/A'), 'gear_ratio': (78.71, '1'),
    'wheel_inertia': (0.08, 'kg·m²'), 'mass': (48.39, 'kg'), 'yaw_inertia': (3.0556, 'kg·m²'),
    'supply_voltage': (24.0, 'V'), 'wheel_damping': (1.3016, 'N·m·s/rad'),
    'yaw_damping': (12.865, 'N·m·s/rad'), 'command_gain': (0.8961, 's/m'),
    'turn_ratio': (0.541, 'm'), 'wheel_radius': (0.1651, 'm'), 'track': (0.5708, 'm'),
}


def one(**changed: object) -> Parameter:
    entry = Parameter('mass', 48.0, 'kg', 1.0, 100.0, 'a scale', 0.05, True, 47.0, 49.0)
    return dataclasses.replace(entry, **changed)  # type: ignore[arg-type]


def test_the_packaged_numbers_are_the_papers() -> None:
    parameters = load_model().parameters
    for name, (value, unit) in TABLES.items():
        entry = parameters.entry(name)
        assert (entry.value, entry.unit) == (value, unit), name
        assert entry.lower < value < entry.upper
        assert entry.source
    assert [e.name for e in parameters.entries if e.free] == [
        'wheel_damping', 'yaw_damping', 'command_gain']


@pytest.mark.parametrize(('changed', 'message'), [
    ({'value': 0.5}, 'mass = 0.5 kg is below its lower bound 1'),
    ({'value': 100.5}, 'mass = 100.5 kg is above its upper bound 100'),
    ({'value': math.nan}, 'mass = nan kg is not a finite number'),
    ({'value': math.inf}, 'mass = inf kg is not a finite number'),
    ({'lower': 200.0}, 'mass: lower bound 200 is above upper bound 100'),
])
def test_a_value_outside_is_named_with_its_bound(changed: dict[str, float], message: str) -> None:
    with pytest.raises(ParameterError) as caught:
        one(**changed)
    assert str(caught.value) == message


def test_the_bounds_themselves_are_allowed() -> None:
    assert one(value=1.0).value == 1.0
    assert one(value=100.0).value == 100.0


def test_parameters_are_a_mapping_of_values() -> None:
    parameters = Parameters((one(), one(name='track', value=2.0)))
    assert dict(parameters) == {'mass': 48.0, 'track': 2.0}
    assert len(parameters) == 2
    assert 'track' in parameters
    assert 'trak' not in parameters
    with pytest.raises(KeyError):
        parameters['trak']
    with pytest.raises(ParameterError, match=r"unknown parameter 'trak'; did you mean track\?"):
        parameters.entry('trak')
    with pytest.raises(ParameterError, match='given twice: mass'):
        Parameters((one(), one(value=50.0)))


def test_replacing_checks_and_forgets_the_old_interval() -> None:
    parameters = Parameters((one(), one(name='track', value=2.0)))
    changed = parameters.replacing({'mass': 60.0})
    assert (changed['mass'], changed['track'], parameters['mass']) == (60.0, 2.0, 48.0)
    assert changed.entry('mass').low is None
    assert changed.entry('mass').high is None
    assert changed.entry('track').low == 47.0
    with pytest.raises(ParameterError, match='mass = 1000 kg is above'):
        parameters.replacing({'mass': 1000.0})
    with pytest.raises(ParameterError, match="unknown parameter 'mas'"):
        parameters.replacing({'mas': 1.0})


def test_with_entries_adds_or_takes_the_place() -> None:
    parameters = Parameters((one(), one(name='track', value=2.0)))
    grown = parameters.with_entries(one(name='play', value=3.0), one(value=55.0))
    assert list(grown) == ['mass', 'track', 'play']
    assert list(grown.values()) == [55.0, 2.0, 3.0]


def test_settings_of_the_command_line() -> None:
    assert parse_settings(('mass=50', ' track = 0.555')) == {'mass': 50.0, 'track': 0.555}
    for text in ('mass', 'mass=', 'mass=heavy', '=3', 'mass=1,5'):
        with pytest.raises(ParameterError, match='is not of the form NAME=VALUE'):
            parse_settings((text,))
    with pytest.raises(ParameterError, match='mass is given twice'):
        parse_settings(('mass=50', ' mass=60'))
    for text in ('model=3', 'about=1', 'self=2'):
        with pytest.raises(ParameterError, match='is no parameter'):
            parse_settings((text,))
    model = apply_settings(load_model(), {'track': 0.555})
    assert model.parameters['track'] == 0.555
    with pytest.raises(ParameterError, match='track = -1 m is not positive'):
        apply_settings(load_model(), {'track': -1.0})
    with pytest.raises(ParameterError, match='is not a finite number'):
        apply_settings(load_model(), parse_settings(('track=nan',)))


def test_a_structure_says_which_parameter_it_misses() -> None:
    parameters = load_model().parameters
    for name, message in (('track', "parameter 'track' of element 'TF_2'"),
                          ('turn_ratio', "parameter 'turn_ratio' is missing")):
        fewer = Parameters(tuple(e for e in parameters.entries if e.name != name))
        with pytest.raises(ParameterError, match=message):
            compile_model(Structure()).at(fewer)


def test_asking_whether_there_is_a_parameter_looks_for_no_near_name(
        monkeypatch: pytest.MonkeyPatch) -> None:
    """Models are compiled by such questions; near names are for messages."""
    parameters = load_model().parameters
    with pytest.raises(KeyError, match='did you mean mass'):
        parameters['mas']

    def near(*_: object, **__: object) -> None:
        raise AssertionError
    monkeypatch.setattr('difflib.get_close_matches', near)
    assert 'mass' in parameters
    assert 'mas' not in parameters
