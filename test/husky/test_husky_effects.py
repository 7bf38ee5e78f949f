# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The catalogue: its ids, its neutral sizes, and which way each effect pushes the robot."""

from __future__ import annotations

from collections.abc import Callable, Mapping
import math
from string import Formatter

from lg_husky_sim.errors import ParameterError
from lg_husky_sim.husky.effects import catalogue, descriptions, Effect, Onset, OnsetKind
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import FloatArray, Pose, TimeSeries
from lg_husky_sim.simulation import rollout
import numpy as np
import pytest

Maker = Callable[..., Plant]

IDS = {
    'battery_sag': 'electrical', 'battery_droop': 'electrical', 'current_limit': 'electrical',
    'driver_deadband': 'electrical', 'voltage_saturation': 'electrical',
    'motor_heating': 'electrical',
    'command_latency': 'command', 'command_slew': 'command', 'command_limit': 'command',
    'speed_loop': 'command',
    'coulomb_drivetrain': 'drivetrain', 'viscous_asymmetry': 'drivetrain',
    'belt_compliance': 'drivetrain', 'gear_backlash': 'drivetrain',
    'torque_ripple': 'drivetrain',
    'wheel_radius_mismatch': 'traction', 'traction_saturation': 'traction',
    'payload': 'translation', 'slope': 'translation', 'rolling_resistance': 'translation',
    'quadratic_drag': 'translation',
    'yaw_scrub_coulomb': 'rotation', 'yaw_scrub_speed': 'rotation', 'yaw_pull': 'rotation',
    'terrain_change': 'rotation',
    'gyro_bias': 'sensor', 'gyro_scale': 'sensor', 'gyro_sign': 'sensor',
    'encoder_scale': 'sensor', 'sensor_time_offset': 'sensor',
}
"""The interface: id to subsystem, typed here and not read from the catalogue. Effects that came
later have their ids in tests of their own."""

ALL = [Effect(kind.id, side, shape) for kind in (*catalogue().values(), *descriptions().values())
       for side in kind.sides for shape in kind.shapes]
CIRCLE = Effect('traction_saturation', shape='circle')
STRAIGHT, TURN = (0.6, 0.0), (0.5, 0.4)


def name_of(value: object) -> str:
    return '-'.join((value.id, value.side, value.shape)) if isinstance(value, Effect) else ''


def driven(plant: Plant, *commands: tuple[float, float], each: float = 1.0) -> TimeSeries:
    """Hold each command for ``each`` seconds, from rest."""
    series = TimeSeries(each * np.arange(len(commands), dtype=np.float64), np.array(commands),
                        ('forward', 'yaw'))
    return rollout(plant, series, each * len(commands), 0.02, pose=Pose(0.0, 0.0, 0.2))


def last(plant: Plant, command: tuple[float, float], channel: str) -> float:
    return float(driven(plant, command, each=3.0).column(channel)[-1])


WANDER = ((0.6, 0.0), (0.6, 0.4), (0.0, -0.5), (-0.5, 0.2), (0.01, 0.0), (0.0, 0.0))


def test_ids_and_subsystems() -> None:
    assert len(IDS) == 30
    parts = {name: kind.subsystem.value for name, kind in catalogue().items()}
    assert IDS.items() <= parts.items()
    for name, kind in catalogue().items():
        assert kind.id == name
        assert kind.title
        assert kind.elements
        for parameter in kind.parameters:
            assert parameter.unit
            assert parameter.source
            for start in parameter.starts:
                assert parameter.lower <= start <= parameter.upper, parameter.name
    assert [n for n, k in catalogue().items() if k.needs_onset] == ['terrain_change']


def test_unknown_ids_sides_and_shapes_are_refused() -> None:
    for part, whole in (('coulomb', 'coulomb_drivetrain or yaw_scrub_coulomb'),
                        ('dead band', 'driver_deadband')):
        with pytest.raises(ParameterError, match=f'did you mean {whole}[?]'):
            Effect(part)
    with pytest.raises(ParameterError, match=r'unknown effect .*did you mean payload'):
        Effect('paylod')
    with pytest.raises(ParameterError) as refusal:
        Effect('smooth')
    assert 'smooth_' not in str(refusal.value)
    with pytest.raises(ParameterError, match=r'side .*both.* of effect encoder_scale'):
        Effect('encoder_scale', 'both')
    with pytest.raises(ParameterError, match=r'shape .*round.* of effect driver_deadband'):
        Effect('driver_deadband', shape='round')


@pytest.mark.parametrize('effect', ALL, ids=name_of)
def test_every_side_and_shape_drives_and_shows(robot: Maker, effect: Effect) -> None:
    """At the sizes from which an estimation starts: finite, and not the nominal robot."""
    needed = (CIRCLE,) if effect.shape == 'grip' else ()
    plant = robot(*needed, effect)
    run = driven(plant, *WANDER)
    seen = plant.observe(run)
    assert np.all(np.isfinite(seen.values))
    assert np.abs(seen.column('forward')).max() < 3.0
    base = robot(*needed)
    changed = np.abs(seen.values - base.observe(driven(base, *WANDER)).values).max()
    assert changed > 1e-6, name_of(effect)


NEUTRAL: list[tuple[Effect, dict[str, float]]] = [
    (Effect('battery_sag'), {'bus_resistance': 0.0}),
    (Effect('battery_droop'), {'droop_rate': 0.0}),
    (Effect('current_limit'), {'current_limit': 200.0}),
    (Effect('driver_deadband', shape='zone'), {'dead_voltage': 0.0}),
    (Effect('driver_deadband', shape='band'), {'dead_voltage': 0.0, 'dead_edge': 0.001}),
    (Effect('driver_deadband', shape='soft'), {'dead_voltage': 0.0}),
    (Effect('voltage_saturation'), {'clip_voltage': 24.0}),
    (Effect('motor_heating'), {'heating_rate': 0.0}),
    (Effect('command_latency'), {'latency': 0.0}),
    (Effect('command_limit', shape='both'), {'limit_forward': 20.0, 'limit_yaw': 20.0}),
    *((Effect('coulomb_drivetrain', side), {'dry_torque': 0.0})
      for side in ('left', 'right', 'both')),
    *((Effect('viscous_asymmetry', side, 'slip'), {'damping_change': 0.0})
      for side in ('left', 'right')),
    *((Effect('viscous_asymmetry', side, 'bearing'), {'extra_damping': 0.0})
      for side in ('left', 'right')),
    (Effect('torque_ripple', 'both'), {'ripple_cos': 0.0, 'ripple_sin': 0.0}),
    *((Effect('wheel_radius_mismatch', side), {'radius_change': 0.0})
      for side in ('left', 'right')),
    *((Effect('payload', shape=shape), {'payload_mass': 0.0, 'payload_inertia': 0.0})
      for shape in ('chassis', 'ground')),
    (Effect('slope'), {'slope_x': 0.0, 'slope_y': 0.0}),
    (Effect('rolling_resistance'), {'rolling_force': 0.0}),
    (Effect('quadratic_drag'), {'drag': 0.0}),
    (Effect('yaw_scrub_coulomb'), {'yaw_coulomb_moment': 0.0}),
    (Effect('yaw_scrub_speed'), {'scrub_slope': 0.0}),
    (Effect('yaw_pull'), {'pull_moment': 0.0}),
    (Effect('terrain_change'), {'wheel_damping_change': 0.0, 'yaw_damping_change': 0.0}),
    (Effect('terrain_change', shape='ground'), {
        'wheel_damping_change': 0.0, 'yaw_damping_change': 0.0, 'floor_drag': 0.0}),
    (Effect('gyro_bias'), {'gyro_bias': 0.0}),
    (Effect('gyro_scale'), {'gyro_factor': 1.0}),
    *((Effect('encoder_scale', side), {'encoder_factor': 1.0}) for side in ('left', 'right')),
    *((Effect('sensor_time_offset', shape=shape), {'stamp_delay': 0.0})
      for shape in ('wheels', 'imu', 'pose')),
    *((Effect(name, shape=shape), {f'knot_{i}': 0.0 for i in range(1, 10)})
      for name, kind in descriptions().items() for shape in kind.shapes),
]


@pytest.mark.parametrize(('effect', 'values'), NEUTRAL, ids=name_of)
def test_the_neutral_size_changes_nothing(robot: Maker, effect: Effect,
                                          values: dict[str, float]) -> None:
    plant, base = robot(effect, **values), robot()
    np.testing.assert_allclose(plant.observe(driven(plant, *WANDER)).values,
                               base.observe(driven(base, *WANDER)).values, rtol=0, atol=1e-9)


def test_limits_without_an_exact_neutral_size_come_near_it(robot: Maker) -> None:
    """A tyre that saturates at 300 N·m, a belt of 10^6 N·m/rad, teeth without play."""
    base = driven(robot(), *WANDER).values[:, 2:4]
    for effect, values, near in (
            ('gear_backlash', {'play': 0.0, 'tooth_stiffness': 1e5}, 1e-3),
            ('traction_saturation', {'traction_torque': 300.0}, 2e-4),
            ('belt_compliance', {'belt_stiffness': 1e6, 'belt_damping': 2.0}, 2e-2)):
        assert np.abs(driven(robot(effect, **values), *WANDER).values[:, 2:4] - base).max() < near


def test_grip_is_shared_between_driving_and_scrubbing(robot: Maker) -> None:
    """
    Force of a wheel is along its slip, whatever the ground holds.

    In a steady turn both the driving and the scrubbing forces therefore lose the same factor, and
    the rate of turn does not depend on the grip; how soon it is reached does.
    """
    pivot = (0.0, 0.5)
    tight = robot(CIRCLE, traction_torque=0.5)
    assert last(tight, pivot, 'yaw_rate') == pytest.approx(
        last(robot(), pivot, 'yaw_rate'), rel=0.03)
    soon = [driven(r, pivot, each=0.3).column('yaw_rate')[5] for r in (robot(), tight)]
    assert 0.0 < soon[1] < 0.7 * soon[0]
    # Where the robot also turns, less is left to drive: the same limit along the wheels alone
    # hinders a turn instead.
    along = robot('traction_saturation', traction_torque=0.5)
    assert last(along, pivot, 'yaw_rate') < 0.7 * last(tight, pivot, 'yaw_rate')


def test_more_grip_undoes_a_limit(robot: Maker) -> None:
    more = Effect('terrain_change', shape='grip')
    changed = driven(robot(CIRCLE, more, traction_torque=1.0, grip_change=1.0), *WANDER)
    twice = driven(robot(CIRCLE, traction_torque=2.0), *WANDER)
    np.testing.assert_allclose(changed.values, twice.values, rtol=0, atol=1e-9)
    with pytest.raises(ParameterError, match=r'grip .* needs traction_saturation'):
        robot(more)


def test_a_load_on_the_ground_scales_what_the_ground_does(robot: Maker) -> None:
    """A payload as heavy as the robot doubles dampings and grip, whatever the order."""
    load = Effect('payload', shape='ground')
    mass = load_model().parameters['mass']
    heavy = [driven(robot(*effects, payload_mass=mass, payload_inertia=0.0, traction_torque=1.0),
                    *WANDER).values for effects in ((CIRCLE, load), (load, CIRCLE))]
    numbers = {name: 2.0 * load_model().parameters[name] for name in (
        'mass', 'wheel_damping', 'yaw_damping')}
    same = driven(robot(CIRCLE, traction_torque=2.0, **numbers), *WANDER)
    for values in heavy:
        np.testing.assert_allclose(values, same.values, rtol=0, atol=1e-9)


def test_the_others_are_covered() -> None:
    """Every entry has a neutral size above, or a reason for having none."""
    none = {'gyro_sign', 'speed_loop', 'traction_saturation', 'belt_compliance', 'command_slew',
            'gear_backlash'}
    assert {effect.id for effect, _ in NEUTRAL} | none == set(IDS) | set(descriptions())


@pytest.mark.parametrize(('effect', 'values'), [
    ('rolling_resistance', {'rolling_force': 30.0}),
    ('quadratic_drag', {'drag': 60.0}),
    ('voltage_saturation', {'clip_voltage': 8.0}),
    ('driver_deadband', {'dead_voltage': 3.0}),
    ('battery_droop', {'droop_rate': 0.05}),
    (Effect('command_limit', shape='forward'), {'limit_forward': 0.4}),
    (Effect('coulomb_drivetrain', 'both'), {'dry_torque': 5.0}),
])
def test_losses_slow_the_robot_both_ways(robot: Maker, effect: str | Effect,
                                         values: dict[str, float]) -> None:
    for sign in (1.0, -1.0):
        command = (sign * 0.6, 0.0)
        base = sign * last(robot(), command, 'forward')
        assert 0.0 < sign * last(robot(effect, **values), command, 'forward') < 0.99 * base


@pytest.mark.parametrize(('effect', 'values'), [
    ('yaw_scrub_coulomb', {'yaw_coulomb_moment': 4.0}),
    ('yaw_scrub_speed', {'scrub_slope': 10.0}),
    ('terrain_change', {'wheel_damping_change': 0.0, 'yaw_damping_change': 1.0}),
    ('traction_saturation', {'traction_torque': 1.0}),
    ('current_limit', {'current_limit': 0.3}),
    ('command_limit', {'limit_yaw': 0.2}),
])
def test_scrub_and_limits_slow_the_turning(robot: Maker, effect: str,
                                           values: dict[str, float]) -> None:
    for sign in (1.0, -1.0):
        command = (0.5, sign * 0.5)
        base = sign * last(robot(), command, 'yaw_rate')
        assert 0.0 < sign * last(robot(effect, **values), command, 'yaw_rate') < 0.97 * base


@pytest.mark.parametrize(('effect', 'values'), [
    ('coulomb_drivetrain', {'dry_torque': 5.0}),
    ('viscous_asymmetry', {'extra_damping': 3.0}),
    ('wheel_radius_mismatch', {'radius_change': -0.05}),
])
def test_what_holds_one_side_back_turns_the_robot_to_it(robot: Maker, effect: str,
                                                        values: dict[str, float]) -> None:
    """Positive yaw is to the left: a slow left side turns left, going ahead."""
    shape = 'bearing' if effect == 'viscous_asymmetry' else ''
    left, right = (last(robot(Effect(effect, side, shape), **values), STRAIGHT, 'yaw_rate')
                   for side in ('left', 'right'))
    assert left > 0.005
    assert left == pytest.approx(-right, rel=1e-6)
    back = last(robot(Effect(effect, 'left', shape), **values), (-0.6, 0.0), 'yaw_rate')
    assert back == pytest.approx(-left, rel=1e-6)


@pytest.mark.parametrize('other', [
    (Effect('terrain_change'), {'wheel_damping_change': 0.8}),
    (Effect('payload', shape='ground'), {'payload_mass': 30.0})])
def test_a_stiffer_side_stays_so_on_other_ground(
        other: tuple[Effect, Mapping[str, float]]) -> None:
    """Factors on the same tyres multiply, whichever was found first."""
    nominal = load_model()
    mine = (Effect('viscous_asymmetry', 'left', 'slip'), {'damping_change': -0.4})
    matrices = []
    for order in ((mine, other), (other, mine)):
        structure, values = nominal.structure, dict[str, float]()
        for effect, sizes in order:
            structure = structure.with_effect(effect)
            values.update({p.name: p.starts[0] for p in effect.parameters()} | dict(sizes))
        parameters = nominal.parameters.with_entries(*(
            p.parameter(values[p.name]) for e in structure.effects for p in e.parameters()))
        matrices.append(compile_model(structure).at(parameters).sets[0].a)
    np.testing.assert_allclose(matrices[0], matrices[1], rtol=1e-12)


def test_a_floor_that_also_resists_is_damping_with_rolling_resistance(robot: Maker) -> None:
    damping = {'wheel_damping_change': 0.4, 'yaw_damping_change': 1.5}
    ground = driven(robot(Effect('terrain_change', shape='ground'), floor_drag=12.0, **damping),
                    *WANDER)
    both = driven(robot('terrain_change', 'rolling_resistance', rolling_force=12.0, **damping),
                  *WANDER)
    np.testing.assert_allclose(ground.values, both.values, atol=1e-9)
    alone = driven(robot('terrain_change', **damping), *WANDER)
    assert np.abs(ground.values - alone.values).max() > 0.01


def test_pull_slope_and_payload(robot: Maker) -> None:
    pulled = robot('yaw_pull', pull_moment=3.0)
    assert last(pulled, STRAIGHT, 'yaw_rate') > 0.01
    assert last(pulled, (-0.6, 0.0), 'yaw_rate') > 0.01  # to the same side
    assert last(pulled, (0.0, 0.0), 'yaw_rate') == 0.0
    dragged = robot(Effect('yaw_pull', shape='dragging'), pull_moment=3.0)
    assert last(dragged, STRAIGHT, 'yaw_rate') == pytest.approx(last(pulled, STRAIGHT, 'yaw_rate'))
    assert last(dragged, (-0.6, 0.0), 'yaw_rate') < -0.01  # the other way in reverse
    assert last(dragged, (0.0, 0.0), 'yaw_rate') == 0.0
    hill = robot('slope', slope_x=-20.0, slope_y=0.0)  # gravity pulls towards -x
    assert last(hill, STRAIGHT, 'forward') < last(robot(), STRAIGHT, 'forward')
    assert last(hill, (0.0, 0.0), 'x') < 0.0
    turned = TimeSeries(np.zeros(1), np.zeros((1, 2)), ('forward', 'yaw'))
    downhill = rollout(hill, turned, 1.0, 0.02, pose=Pose(0.0, 0.0, math.pi))
    assert downhill.column('forward')[-1] > 0.0
    assert downhill.column('x')[-1] < 0.0
    early = 15
    heavy = driven(robot('payload', payload_mass=40.0, payload_inertia=0.0), STRAIGHT)
    assert heavy.column('forward')[early] < 0.9 * driven(
        robot(), STRAIGHT).column('forward')[early]
    loaded = driven(robot('payload', payload_mass=40.0), STRAIGHT, each=12.0)
    assert loaded.column('forward')[-1] == pytest.approx(
        driven(robot(), STRAIGHT, each=12.0).column('forward')[-1], rel=1e-6)


def test_sag_and_heat_weaken_the_motors(robot: Maker) -> None:
    """Both need current: a turn."""
    for effect, values in (('battery_sag', {'bus_resistance': 0.3}),
                           ('motor_heating', {'heating_rate': 0.01})):
        base = last(robot(), TURN, 'yaw_rate')
        assert last(robot(effect, **values), TURN, 'yaw_rate') < base - 1e-4, effect


def test_latency_slew_and_backlash_are_late(robot: Maker) -> None:
    base = driven(robot(), STRAIGHT)
    for effect, values in (('command_latency', {'latency': 0.1}),
                           ('command_slew', {'slew_forward': 0.5}),
                           ('gear_backlash', {'play': 0.5})):
        run = driven(robot(effect, **values), STRAIGHT)
        assert run.column('forward')[8] < 0.95 * base.column('forward')[8], effect
        assert run.column('distance')[-1] < base.column('distance')[-1], effect


def test_sensors_read_what_they_are_told(robot: Maker) -> None:
    truth = driven(robot(), STRAIGHT, TURN)
    honest = robot().observe(truth)

    def read(effect: str | Effect, channel: str, **values: float) -> FloatArray:
        return robot(effect, **values).observe(truth).column(channel)
    rate = truth.column('yaw_rate')
    np.testing.assert_allclose(read('gyro_bias', 'yaw_rate', gyro_bias=0.1), rate + 0.1)
    np.testing.assert_allclose(read('gyro_scale', 'yaw_rate', gyro_factor=1.1), 1.1 * rate)
    np.testing.assert_allclose(read('gyro_sign', 'yaw_rate'), -rate)
    scaled = Effect('encoder_scale', 'right')
    for channel, factor in (('wheel_right', 1.2), ('angle_right', 1.2), ('wheel_left', 1.0)):
        np.testing.assert_allclose(read(scaled, channel, encoder_factor=1.2),
                                   factor * honest.column(channel))
    for shape, moved, kept in (('wheels', 'wheel_left', 'yaw_rate'), ('imu', 'yaw_rate', 'x'),
                               ('pose', 'x', 'wheel_left')):
        late = Effect('sensor_time_offset', shape=shape)
        np.testing.assert_allclose(read(late, moved, stamp_delay=0.1)[5:],
                                   honest.column(moved)[:-5], atol=1e-9)
        np.testing.assert_array_equal(read(late, kept, stamp_delay=0.1), honest.column(kept))
    # An encoder counts ticks: the mean rate of the last 20 ms.
    angle = truth.column('angle_left')
    np.testing.assert_allclose(honest.column('wheel_left')[1:], np.diff(angle) / 0.02, atol=1e-9)


def test_a_belt_needs_the_expanded_drivetrain() -> None:
    from lg_husky_sim.husky.model import compile_model, Drivetrain, Structure
    with pytest.raises(ParameterError, match='belt_compliance needs the expanded drivetrain'):
        compile_model(Structure(Drivetrain.SIMPLIFIED, (Effect('belt_compliance'),)))


def test_late_effects_need_an_onset_and_may_not_add_states(robot: Maker) -> None:
    with pytest.raises(ParameterError, match='payload begins at an onset, but the model has none'):
        robot(Effect('payload', late=True))
    with pytest.raises(ParameterError, match='effect with an onset may not add states'):
        robot(Effect('speed_loop', late=True), onset=Onset(OnsetKind.TIME, 1.0))


@pytest.mark.parametrize('name', list(catalogue()))
def test_every_effect_says_what_to_do_with_its_own_numbers(name: str) -> None:
    kind = catalogue()[name]
    assert kind.advice.robot
    known = {p.name for p in kind.parameters} | {
        'side', 'where', 'wheels', 'stream', 'offset', 'amplitude', 'phase'}
    for sentence in (*kind.advice.robot, *kind.advice.simulator, *kind.advice.instead):
        assert {part[1] for part in Formatter().parse(sentence) if part[1]} <= known
        assert sentence.count('`') % 2 == 0
