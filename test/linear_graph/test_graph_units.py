# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Units: read, scaled, and checked against every element of every domain."""

from __future__ import annotations

from math import pi

from lg_husky_sim.errors import GraphError
from lg_husky_sim.husky import network
from lg_husky_sim.linear_graph import (
    Branch,
    Characteristic,
    Domain,
    Form,
    Kind,
    LinearGraph,
    TwoPort,
)
from lg_husky_sim.linear_graph.units import check_units, parse_unit, unit_needed
from lg_husky_sim.resources import config_path
import pytest
import yaml


def husky_units() -> dict[str, str]:
    text = config_path('husky.yaml').read_text(encoding='utf-8')
    return {name: entry['unit'] for name, entry in yaml.safe_load(text)['parameters'].items()}


@pytest.mark.parametrize(('one', 'other'), [
    ('N·m·s/rad', 'kg*m^2/s'), ('V', 'W/A'), ('ohm', 'Ω'), ('H', 'V*s/A'), ('F', 'A·s/V'),
    ('Pa·s²/m³', 'kg/m^4'), ('J/K', 'W s/K'), ('N/m', 'kg/s**2'), ('N·m/A', 'V·s/rad'),
    ('kg.m^2', 'kg·m²'), ('N.m/rad', 'N·m/rad'), ('N-m/rad', 'N·m/rad'), ('kg m2', 'kg·m²'),
    ('m3/Pa', 'm³/Pa'), ('N·m·s⁻²', 'N*m/s**2'), ('m⁵/N', 'm^5/N'), ('kg∙m²', 'kg·m²'),
    ('1', 'rad'), ('m³/Pa', 'm^5/N'), ('S', '1/ohm'), ('', 'rad/rad'), ('Wb', 'V s'),
])
def test_two_ways_to_write_one_unit(one: str, other: str) -> None:
    assert parse_unit(one).dimension == parse_unit(other).dimension
    assert parse_unit(one).scale == parse_unit(other).scale


@pytest.mark.parametrize(('text', 'scale'), [
    ('mH', 1e-3), ('µF', 1e-6), ('kN/m', 1e3), ('g·cm²', 1e-7), ('kPa·s/m³', 1e3), ('mm', 1e-3),
    ('MPa', 1e6), ('1/ms', 1e3), ('mL', 1e-6), ('mbar', 100.0), ('L/min', 1e-3 / 60.0),
    ('V/rpm', 30.0 / pi), ('deg/s', pi / 180.0), ('°', pi / 180.0), ('A·h', 3600.0),
    ('W/°C', 1.0), ('hPa', 100.0), ('dm³', 1e-3), ('TPa', 1e12), ('fF', 1e-15),
])
def test_prefixes_scale(text: str, scale: float) -> None:
    assert parse_unit(text).scale == pytest.approx(scale, rel=1e-12)


@pytest.mark.parametrize('text', [
    'furlong', 'N·', 'm/', 'N+m', '2*m', 'sqrt(m)', 'm**m', 'x' * 100, 'N(m)', '(', '3',
])
def test_what_is_no_unit_is_refused(text: str) -> None:
    with pytest.raises(GraphError, match='unit'):
        parse_unit(text)


@pytest.mark.parametrize(('text', 'meant'), [
    ('Nm', 'N·m'), ('mNm', 'mN·m'), ('ohms', 'ohm'), ('kohms', 'kohm'), ('cc', 'cm³'),
    ('Nms/rad', 'N·m·s'), ('KΩ', 'kohm'), ('Kg', 'kg'), ('mh', 'mH'),
    ('kw', 'kW'), ('kgm²', 'kg·m')])
def test_a_unit_that_may_be_meant_is_suggested(text: str, meant: str) -> None:
    with pytest.raises(GraphError, match=f"is not a known unit; did you mean '{meant}'"):
        parse_unit(text)


@pytest.mark.parametrize('text', ['mmin', 'krpm', 'kdeg'])
def test_units_beside_the_si_have_no_prefixes(text: str) -> None:
    with pytest.raises(GraphError, match='is not a known unit'):
        parse_unit(text)


def test_temperatures_have_their_zero_in_kelvin() -> None:
    with pytest.raises(GraphError, match=r"unit '°C': temperatures are given from absolute zero"):
        parse_unit('°C')


@pytest.mark.parametrize('make', [network.simplified, network.expanded])
def test_husky_s_units_fit(make: object) -> None:
    assert callable(make)
    assert check_units(make(), husky_units()) == ()


def test_the_paper_s_unit_of_damping_is_caught() -> None:
    for name, element in (('wheel_damping', 'B_RL'), ('yaw_damping', 'B_H')):
        units = {**husky_units(), name: 'rad/(N·m·s)'}
        with pytest.raises(GraphError, match=(
                rf"unit of '{element}': {name} with {name} \[rad/\(N·m·s\)\] does not fit a "
                r'rotational D-type \(damping\), which needs N·m·s/rad; it is the inverse')):
            check_units(network.simplified(), units)


@pytest.mark.parametrize('parameter', [
    'wheel_inertia', 'mass', 'yaw_inertia', 'motor_resistance', 'motor_inductance',
    'torque_constant', 'wheel_radius', 'wheel_damping', 'yaw_damping', 'belt_stiffness',
    'belt_damping', 'track', 'wheelbase',
])
def test_every_parameter_of_the_husky_with_a_wrong_unit_is_caught(parameter: str) -> None:
    units = {**husky_units(), parameter: 'K'}
    with pytest.raises(GraphError, match=parameter):
        check_units(network.expanded(), units)


@pytest.mark.parametrize('domain', Domain)
def test_every_element_s_usual_unit_is_accepted_and_another_refused(domain: Domain) -> None:
    kinds: list[tuple[Kind, Form | None]] = [
        (Kind.A_TYPE, None), (Kind.D_TYPE, Form.RESISTANCE), (Kind.D_TYPE, Form.DAMPING)]
    if domain is not Domain.THERMAL:
        kinds += [(Kind.T_TYPE, Form.INERTANCE), (Kind.T_TYPE, Form.STIFFNESS)]
    for kind, form in kinds:
        element = Branch('x', kind, domain, 'n', 'ground', 'x', form)
        # dimensions by the definition of the element, not by the table of units
        across, through = {
            Domain.ELECTRICAL: ('V', 'A'), Domain.TRANSLATIONAL: ('m/s', 'N'),
            Domain.ROTATIONAL: ('rad/s', 'N·m'), Domain.FLUID: ('Pa', 'm³/s'),
            Domain.THERMAL: ('K', 'W')}[domain]
        ratio = {
            Kind.A_TYPE: f'({through})*s/({across})',
            Form.INERTANCE: f'({across})*s/({through})',
            Form.STIFFNESS: f'({through})/s/({across})',
            Form.RESISTANCE: f'({across})/({through})',
            Form.DAMPING: f'({through})/({across})'}[form or kind]
        assert parse_unit(unit_needed(element)).dimension == parse_unit(ratio).dimension
        graph = LinearGraph((element, Branch('s', Kind.THROUGH_SOURCE, domain, 'n', 'ground')))
        assert check_units(graph, {'x': unit_needed(element)}) == ()
        assert check_units(graph, {}) == ('x',)
        with pytest.raises(GraphError, match="unit of 'x'"):
            check_units(graph, {'x': 'm·K'})


def test_two_ports_and_units_of_elements_themselves() -> None:
    motor = TwoPort('k', Kind.TRANSFORMER, (Domain.ELECTRICAL, 'a', 'ground'),
                    (Domain.ROTATIONAL, 'w', 'ground'), 'k*n', 'V·s/rad')
    pump = TwoPort('p', Kind.GYRATOR, (Domain.ROTATIONAL, 'w', 'ground'),
                   (Domain.FLUID, 'q', 'ground'), '1/d')
    graph = LinearGraph((), (motor, pump))
    assert check_units(graph, {'k': 'N·m/A', 'n': '1', 'd': 'm³/rad'}) == ()
    with pytest.raises(GraphError, match=r"unit of 'k': k\*n .* transformer, which needs V"):
        check_units(graph, {'k': 'N·m', 'n': '1', 'd': 'm³'})
    with pytest.raises(GraphError, match=r"unit of 'p': .* gyrator"):
        check_units(graph, {'d': 'm²'})


def test_laws_are_checked_by_their_parameters() -> None:
    body = (Branch('m', Kind.A_TYPE, Domain.TRANSLATIONAL, 'n', 'ground', 'm'),
            Branch('F', Kind.THROUGH_SOURCE, Domain.TRANSLATIONAL, 'n', 'ground',
                   characteristic=Characteristic('coulomb', ('v(m)',), ('level', 'width'))))
    graph = LinearGraph(body)
    units = {'m': 'kg', 'level': 'N', 'width': 'm/s'}
    assert check_units(graph, units) == ()
    with pytest.raises(GraphError, match=r"element 'F', its law coulomb: tanh needs a pure"):
        check_units(graph, {**units, 'width': 'N'})
    with pytest.raises(GraphError, match=r"unit of 'F': its law coulomb with level \[kg\]"):
        check_units(graph, {**units, 'level': 'kg'})


def test_unlike_things_are_not_added() -> None:
    graph = LinearGraph((Branch('m', Kind.A_TYPE, Domain.TRANSLATIONAL, 'n', 'ground', 'm + J'),))
    with pytest.raises(GraphError, match=r"element 'm', m \+ J: m and J have different units"):
        check_units(graph, {'m': 'kg', 'J': 'kg·m²'})
    assert check_units(graph, {'m': 'kg', 'J': 'g'}) == ()


@pytest.mark.parametrize('unit', ['N·m/Hz', 'N·m/kHz'])
def test_hertz_are_refused_in_rotation(unit: str) -> None:
    """1 Hz would be 1 rad/s or 6.28 rad/s; elsewhere it is 1/s."""
    damper = Branch('B', Kind.D_TYPE, Domain.ROTATIONAL, 'n', 'ground', 'B')
    with pytest.raises(GraphError, match=f"'B': {unit} may mean turns or radians in a second"):
        check_units(LinearGraph((damper,)), {'B': unit})
    coil = Branch('L', Kind.T_TYPE, Domain.ELECTRICAL, 'n', 'ground', 'L')
    assert check_units(LinearGraph((coil,)), {'L': 'ohm/Hz'}) == ()


def test_what_would_fit_is_said() -> None:
    damper = Branch('B', Kind.D_TYPE, Domain.ROTATIONAL, 'n', 'ground', 'B')
    with pytest.raises(GraphError, match=r'needs N·m·s/rad; write N·m/\(rad/s\)$'):
        check_units(LinearGraph((damper,)), {'B': 'N·m/rad/s'})
    valve = Branch('O', Kind.D_TYPE, Domain.FLUID, 'n', 'ground',
                   characteristic=Characteristic('orifice', ('P(O)',), ('k', 'e')))
    with pytest.raises(GraphError, match=r'which needs Pa; it fits with form: damping$'):
        check_units(LinearGraph((valve,)), {'k': 'm³/(s·Pa**0.5)', 'e': 'Pa'})
    cubic = Branch('F', Kind.THROUGH_SOURCE, Domain.TRANSLATIONAL, 'n', 'ground',
                   characteristic=Characteristic('z**3', ('v(F)',)))
    with pytest.raises(GraphError, match=r'its law z\*\*3 does not fit'):
        check_units(LinearGraph((cubic,)), {})


def test_a_prefix_is_no_unit() -> None:
    with pytest.raises(GraphError, match="'k' is a prefix without a unit"):
        parse_unit('k')
