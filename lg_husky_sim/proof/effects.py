# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What each effect of the catalogue changes, in which form: one function an effect."""

from __future__ import annotations

from collections.abc import Mapping
import math

from lg_husky_sim.proof import outside
from lg_husky_sim.proof import world as w
from lg_husky_sim.proof.hidden import Builder, Change, pick, Rng, Setting, sided, sign

FORCE_FORMS = ('brush', 'tanh', 'atan', 'magic formula', 'root')
DRY_FORMS = ('bristles', 'tanh', 'Stribeck', 'root')
SLEW_FORMS = ('rate limit', 'first order', 'rate limit with jerk')
FRICTION_FORMS = ('LuGre', 'tanh', 'Stribeck', 'atan')


def _form(s: Setting, rng: Rng, effect: str, forms: tuple[str, ...]) -> tuple[float, str]:
    """Draw one of the forms that are not left out; return its number and its name."""
    allowed = [name for name in forms if f'{effect} {name}' not in s.left_out]
    name = pick(rng, *allowed)
    return float(forms.index(name)), name


def _battery_sag(s: Setting, rng: Rng) -> Change:
    slow = s.size * float(rng.choice([0.0, rng.uniform(0.1, 0.4)]))
    return Change({'battery_resistance': s.size - slow, 'polarisation': slow,
                   'polarisation_time': float(rng.uniform(2.0, 15.0))},
                  parameters={'source_resistance': s.size},
                  form='with polarisation' if slow > 0.0 else 'resistance')


def _battery_droop(s: Setting, rng: Rng) -> Change:
    form, name = _form(s, rng, 'battery_droop', ('exponential', 'linear', 'charge'))
    depth, time = s.size, s.seconds * float(rng.uniform(0.4, 1.2))
    if form == 1.0:
        time = s.seconds
    elif form == 2.0:
        depth = 1000.0 * s.size / s.drawn_charge
    return Change({'droop_depth': depth, 'droop_time': time, 'form_droop': form},
                  parameters={'final_loss_fraction': s.size}, form=name)


def _current_limit(s: Setting, rng: Rng) -> Change:
    amps = s.peak_current * s.size
    form, name = _form(s, rng, 'current_limit', ('hard', 'soft', 'fold-back'))
    change = {'current_limit': amps, 'form_current': min(form, 1.0)}
    if form == 2.0:
        change = {'current_limit': 1.4 * amps, 'form_current': 0.0,
                  'current_continuous': 0.75 * amps,
                  'current_time': float(rng.uniform(0.3, 1.5))}
    return Change(change, parameters={'current_limit': amps}, form=name)


def _driver_deadband(s: Setting, rng: Rng) -> Change:
    form, name = _form(s, rng, 'driver_deadband', ('subtracted', 'jump'))
    edge = float(rng.choice([0.0, rng.uniform(0.05, 0.15)]))
    return Change({'deadband': s.size, 'deadband_edge': edge, 'form_deadband': form},
                  parameters={'deadband_voltage': s.size}, form=name)


def _voltage_saturation(s: Setting, rng: Rng) -> Change:
    volts = min(s.most_volts, s.fields['supply']) * s.size
    form, name = _form(s, rng, 'voltage_saturation', ('hard', 'tanh'))
    return Change({'clip': volts, 'form_clip': form}, parameters={'voltage_limit': volts},
                  form=name)


def _motor_heating(s: Setting, rng: Rng) -> Change:
    rise = s.fields['resistance'] * s.size
    cooling = s.seconds * float(rng.uniform(0.8, 5.0))
    loss = float(rng.choice([0.0, rng.uniform(0.02, 0.08)]))
    return Change({'heating': rise / s.squared_current, 'cooling_time': cooling,
                   'magnet_loss': loss}, parameters={'resistance_rise': rise},
                  form='with magnets' if loss > 0.0 else 'winding')


def _command_latency(s: Setting, rng: Rng) -> Change:
    spread = float(rng.choice([0.0, rng.uniform(0.1, 0.3)])) * s.size
    return Change(command={'latency': s.size, 'latency_spread': spread},
                  parameters={'latency': s.size},
                  form='with jitter' if spread > 0.0 else 'constant')


def _command_slew(s: Setting, rng: Rng) -> Change:
    form, name = _form(s, rng, 'command_slew', SLEW_FORMS)
    rate = s.steepest * s.size
    yaw = rate * float(rng.uniform(1.0, 2.0))
    if form == 1.0:
        lag = 0.12 * 0.25 / s.size
        return Change(command={'lag': lag}, parameters={'time_constant': lag}, form=name)
    return Change(command={'slew_forward': rate, 'slew_yaw': yaw,
                           'lag': 0.03 if form == 2.0 else 0.0},
                  parameters={'acceleration_limit': rate, 'yaw_acceleration_limit': yaw},
                  form=name)


def _command_limit(s: Setting, rng: Rng) -> Change:
    which = pick(rng, 'forward', 'yaw', 'both')
    if s.most_forward < 0.1:
        which = 'yaw'
    forward = s.size * s.most_forward if which in ('forward', 'both') else 0.0
    yaw = s.size * s.most_yaw if which in ('yaw', 'both') else 0.0
    form, name = _form(s, rng, 'command_limit', ('hard', 'tanh'))
    return Change(command={'limit_forward': forward, 'limit_yaw': yaw, 'limit_soft': form},
                  parameters={'forward_limit': forward, 'yaw_limit': yaw}, form=name)


def _speed_loop(s: Setting, rng: Rng) -> Change:
    # The motor alone settles within milliseconds, so that integral action sets the lag.
    gain = float(rng.uniform(0.2, 0.9))
    per_volt = 1.0 / s.fields['torque_constant']
    period = float(rng.choice([0.005, 0.01, 0.02]))
    common = {'loop': 1.0, 'loop_gain': gain, 'loop_period': period}
    if rng.random() < 0.5:
        return Change({**common, 'loop_integral': (1.0 + gain * per_volt) / (per_volt * s.size),
                       'loop_forward': 0.0}, parameters={'time_constant': s.size}, form='PI')
    return Change({**common, 'loop_integral': float(rng.uniform(20.0, 60.0)),
                   'loop_forward': float(rng.uniform(0.8, 1.0))},
                  {'loop_lag': s.size}, parameters={'time_constant': s.size},
                  form='reference filter')


def _coulomb_drivetrain(s: Setting, rng: Rng) -> Change:
    side = pick(rng, 'left', 'right', 'both')
    form, name = _form(s, rng, 'coulomb_drivetrain', FRICTION_FORMS)
    return Change({**sided('friction', s.size, side), 'form_friction': form,
                   'stribeck_ratio': float(rng.uniform(1.0, 1.6)),
                   'stribeck_speed': float(rng.uniform(0.1, 0.6)),
                   'friction_width': float(rng.uniform(0.03, 0.1))},
                  side=side, parameters={'coulomb_torque': s.size}, form=name)


def _viscous_asymmetry(s: Setting, rng: Rng) -> Change:
    side = pick(rng, 'left', 'right')
    power = float(rng.choice([1.0, rng.uniform(0.8, 1.2)]))
    return Change({**sided('viscous', s.size, side), 'viscous_exponent': power},
                  side=side, parameters={'extra_damping': s.size}, form=f'power {power:.2f}')


def _belt_compliance(s: Setting, rng: Rng) -> Change:
    form, name = _form(s, rng, 'belt_compliance', ('linear', 'hardening', 'slipping'))
    return Change({'belt_stiffness': s.size, 'belt_damping': float(rng.uniform(0.05, 0.6)),
                   'belt_cubic': float(rng.uniform(1.0, 5.0)) if form == 1.0 else 0.0,
                   'belt_limit': float(rng.uniform(4.0, 9.0)) if form == 2.0 else 1e9},
                  side='both', parameters={'belt_stiffness': s.size}, form=name)


def _gear_backlash(s: Setting, rng: Rng) -> Change:
    return Change({'gap': s.size, 'gear_stiffness': float(rng.uniform(500.0, 2000.0)),
                   'gear_damping': float(rng.uniform(1.0, 5.0))},
                  senses={'on_motor': pick(rng, 'yes', 'no')},
                  side='both', parameters={'gap': s.size}, form='teeth')


def _torque_ripple(s: Setting, rng: Rng) -> Change:
    side = pick(rng, 'left', 'right', 'both')
    second = float(rng.choice([0.0, rng.uniform(0.15, 0.5)]))
    return Change({**sided('ripple', s.size, side), 'ripple_second': second,
                   'ripple_phase': float(rng.uniform(0.0, 6.28))},
                  side=side, parameters={'ripple_amplitude': s.size},
                  form='two harmonics' if second > 0.0 else 'one harmonic')


def _wheel_radius_mismatch(s: Setting, rng: Rng) -> Change:
    part = sign(rng) * s.size
    side = pick(rng, 'left', 'right')
    name = f'radius_{side}'
    soft = {}
    if part < 0.0 and rng.random() < 0.5:
        # A soft tyre rolls harder, too: 1 N for each per cent.
        soft = {f'rolling_{side}': 100.0 * s.size}
    return Change({name: s.fields[name] * (1.0 + part), **soft}, side=side,
                  parameters={'radius_change_fraction': part},
                  form='with drag' if soft else 'radius')


def _traction_saturation(s: Setting, rng: Rng) -> Change:
    force = s.size * (1.6 if s.fields['tyre'] > 0.5 else 1.0)
    form, name = _form(s, rng, 'traction_saturation', FORCE_FORMS)
    return Change({'force_limit': force, 'form_force': form}, side='both',
                  parameters={'wheel_force_limit': force}, form=name)


def _payload(s: Setting, rng: Rng) -> Change:
    inertia = s.size * float(rng.uniform(0.15, 0.45)) ** 2
    return Change({'mass': s.fields['mass'] + s.size,
                   'yaw_inertia': s.fields['yaw_inertia'] + inertia},
                  parameters={'extra_mass': s.size, 'extra_inertia': inertia}, form='rigid')


def _slope(s: Setting, rng: Rng) -> Change:
    angle = math.radians(s.size)
    heading = float(rng.uniform(-math.pi, math.pi))
    pull = w.GRAVITY * math.sin(angle)
    return Change({'gravity_x': pull * math.cos(heading), 'gravity_y': pull * math.sin(heading)},
                  parameters={'slope_angle': angle, 'downhill_heading': heading}, form='plane')


def _rolling_resistance(s: Setting, rng: Rng) -> Change:
    form, name = _form(s, rng, 'rolling_resistance', DRY_FORMS)
    return Change({'rolling': s.size, 'form_dry': form}, parameters={'rolling_force': s.size},
                  form=name)


def _quadratic_drag(s: Setting, rng: Rng) -> Change:
    power = float(rng.choice([2.0, rng.uniform(1.7, 2.4)]))
    return Change({'drag': s.size, 'drag_exponent': power},
                  parameters={'drag_coefficient': s.size}, form=f'power {power:.2f}')


def _yaw_scrub_coulomb(s: Setting, rng: Rng) -> Change:
    moment = s.size * (3.0 if s.fields['tyre'] > 0.5 else 1.0)
    form, name = _form(s, rng, 'yaw_scrub_coulomb', DRY_FORMS)
    return Change({'scrub': moment, 'form_dry': form},
                  parameters={'yaw_coulomb_moment': moment}, form=name)


def _yaw_scrub_speed(s: Setting, rng: Rng) -> Change:
    size = s.size * s.fields['yaw_damping'] / max(s.most_forward, 0.3)
    if s.size < 0.9 and rng.random() < 0.3:
        # Less scrub while rolling, as on grass; never all of it.
        size *= -0.6
    power = float(rng.choice([1.0, rng.uniform(0.8, 1.8)]))
    return Change({'scrub_speed': size, 'scrub_exponent': power},
                  parameters={'yaw_damping_per_speed': size}, form=f'power {power:.2f}')


def _yaw_pull(s: Setting, rng: Rng) -> Change:
    moment = s.size * sign(rng) * (3.0 if s.fields['tyre'] > 0.5 else 1.0)
    return Change({'pull': moment, 'pull_speed': float(rng.uniform(0.02, 0.1))},
                  side='left' if moment > 0 else 'right', parameters={'pull_moment': moment},
                  form='fades at rest')


def _terrain_change(s: Setting, rng: Rng) -> Change:
    factor = s.size if rng.random() < 0.7 else 1.0 / s.size
    creep = factor ** float(rng.uniform(-0.4, 0.4))
    return Change({'yaw_damping': s.fields['yaw_damping'] * factor,
                   'creep': s.fields['creep'] * creep,
                   'tyre_friction': s.fields['tyre_friction'] * factor ** 0.7},
                  parameters={'scrub_factor': factor, 'creep_factor': creep}, form='factors')


def _gyro_bias(s: Setting, rng: Rng) -> Change:
    bias = s.size * sign(rng)
    drift = float(rng.choice([0.0, rng.uniform(0.05, 0.3)]))
    return Change(senses={'gyro_bias': bias, 'gyro_drift': bias * drift},
                  parameters={'gyro_bias': bias}, form='drifting' if drift > 0.0 else 'constant')


def _gyro_scale(s: Setting, rng: Rng) -> Change:
    factor = 1.0 + s.size * sign(rng)
    return Change(senses={'gyro_factor': factor}, parameters={'gyro_factor': factor},
                  form='factor')


def _gyro_sign(s: Setting, rng: Rng) -> Change:
    return Change(senses={'gyro_factor': -1.0}, parameters={'gyro_factor': -1.0}, form='factor')


def _encoder_scale(s: Setting, rng: Rng) -> Change:
    factor = 1.0 + s.size * sign(rng)
    side = pick(rng, 'left', 'right')
    return Change(senses={f'encoder_{side}': factor}, side=side,
                  parameters={'encoder_factor': factor}, form='factor')


def _sensor_time_offset(s: Setting, rng: Rng) -> Change:
    stream = pick(rng, *s.streams)
    return Change(senses={'late': stream, 'late_by': s.size}, parameters={'late_by': s.size},
                  form=stream)


BUILDERS: Mapping[str, Builder] = {
    'battery_sag': _battery_sag,
    'battery_droop': _battery_droop,
    'current_limit': _current_limit,
    'driver_deadband': _driver_deadband,
    'voltage_saturation': _voltage_saturation,
    'motor_heating': _motor_heating,
    'command_latency': _command_latency,
    'command_slew': _command_slew,
    'command_limit': _command_limit,
    'speed_loop': _speed_loop,
    'coulomb_drivetrain': _coulomb_drivetrain,
    'viscous_asymmetry': _viscous_asymmetry,
    'belt_compliance': _belt_compliance,
    'gear_backlash': _gear_backlash,
    'torque_ripple': _torque_ripple,
    'wheel_radius_mismatch': _wheel_radius_mismatch,
    'traction_saturation': _traction_saturation,
    'payload': _payload,
    'slope': _slope,
    'rolling_resistance': _rolling_resistance,
    'quadratic_drag': _quadratic_drag,
    'yaw_scrub_coulomb': _yaw_scrub_coulomb,
    'yaw_scrub_speed': _yaw_scrub_speed,
    'yaw_pull': _yaw_pull,
    'terrain_change': _terrain_change,
    'gyro_bias': _gyro_bias,
    'gyro_scale': _gyro_scale,
    'gyro_sign': _gyro_sign,
    'encoder_scale': _encoder_scale,
    'sensor_time_offset': _sensor_time_offset,
    **outside.BUILDERS,
}


def build(effect: str, setting: Setting, rng: Rng) -> Change:
    """
    Draw one hidden effect.

    Raises
    ------
    KeyError
        There is no such effect.

    """
    return BUILDERS[effect](setting, rng)
