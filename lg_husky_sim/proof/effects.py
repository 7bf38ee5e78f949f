# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What each effect of the catalogue changes, and how strongly: one function an effect."""

from __future__ import annotations

from collections.abc import Mapping
import math

from lg_husky_sim.proof import outside
from lg_husky_sim.proof import world as w
from lg_husky_sim.proof.hidden import (
    Builder,
    Change,
    draw,
    pick,
    Rng,
    Setting,
    sided,
    sign,
)


def _battery_sag(s: Setting, rng: Rng) -> Change:
    ohms = draw(rng, s, (0.1, 0.15), (0.2, 0.3), (0.4, 0.6))
    slow = ohms * float(rng.uniform(0.0, 0.3))
    return Change({'battery_resistance': ohms - slow, 'polarisation': slow,
                   'polarisation_time': float(rng.uniform(3.0, 12.0))},
                  parameters={'source_resistance': ohms})


def _battery_droop(s: Setting, rng: Rng) -> Change:
    depth = draw(rng, s, (0.04, 0.06), (0.09, 0.14), (0.2, 0.3))
    return Change({'droop_depth': depth, 'droop_time': float(rng.uniform(25.0, 90.0))},
                  parameters={'final_loss_fraction': depth})


def _current_limit(s: Setting, rng: Rng) -> Change:
    # Relative to what the drive draws without it.
    amps = s.peak_current * draw(rng, s, (0.6, 0.75), (0.35, 0.45), (0.12, 0.2))
    if s.heavy:
        # Turning takes a standing current there, half of the peak and more.
        amps = s.peak_current * draw(rng, s, (0.85, 0.92), (0.65, 0.8), (0.45, 0.55))
    return Change({'current_limit': amps}, parameters={'current_limit': amps})


def _driver_deadband(s: Setting, rng: Rng) -> Change:
    volts = draw(rng, s, (0.4, 0.6), (0.9, 1.5), (2.0, 3.2))
    return Change({'deadband': volts}, parameters={'deadband_voltage': volts})


def _voltage_saturation(s: Setting, rng: Rng) -> Change:
    volts = min(s.most_volts, 24.0) * draw(rng, s, (0.85, 0.9), (0.7, 0.8), (0.5, 0.62))
    return Change({'clip': volts}, parameters={'voltage_limit': volts})


def _motor_heating(s: Setting, rng: Rng) -> Change:
    rise = s.fields['resistance'] * draw(rng, s, (0.3, 0.5), (0.8, 1.3), (2.0, 3.5))
    return Change({'heating': rise / s.squared_current,
                   'cooling_time': float(rng.uniform(80.0, 300.0))},
                  parameters={'resistance_rise': rise})


def _command_latency(s: Setting, rng: Rng) -> Change:
    time = draw(rng, s, (0.04, 0.06), (0.09, 0.15), (0.2, 0.32))
    return Change(command={'latency': time}, parameters={'latency': time})


def _command_slew(s: Setting, rng: Rng) -> Change:
    rate = min(draw(rng, s, (1.8, 2.4), (0.9, 1.3), (0.4, 0.6)),
               s.steepest * draw(rng, s, (0.6, 0.7), (0.35, 0.45), (0.18, 0.25)))
    yaw = rate * float(rng.uniform(1.0, 2.0))
    return Change(command={'slew_forward': rate, 'slew_yaw': yaw},
                  parameters={'acceleration_limit': rate, 'yaw_acceleration_limit': yaw})


def _command_limit(s: Setting, rng: Rng) -> Change:
    part = draw(rng, s, (0.85, 0.9), (0.7, 0.8), (0.5, 0.62))
    which = pick(rng, 'forward', 'yaw', 'both')
    forward = part * s.most_forward if which in ('forward', 'both') else 0.0
    yaw = part * s.most_yaw if which in ('yaw', 'both') else 0.0
    return Change(command={'limit_forward': forward, 'limit_yaw': yaw},
                  parameters={'forward_limit': forward, 'yaw_limit': yaw})


def _speed_loop(s: Setting, rng: Rng) -> Change:
    lag = draw(rng, s, (0.06, 0.1), (0.15, 0.25), (0.35, 0.6))
    # The motor alone settles within milliseconds, so that integral action sets the lag.
    gain = float(rng.uniform(0.2, 0.9))
    per_volt = 1.0 / s.fields['torque_constant']
    if rng.random() < 0.6:
        change = {'loop_integral': (1.0 + gain * per_volt) / (per_volt * lag),
                  'loop_forward': 0.0}
        return Change({'loop': 1.0, 'loop_gain': gain, **change},
                      parameters={'time_constant': lag})
    return Change({'loop': 1.0, 'loop_gain': gain, 'loop_integral': float(rng.uniform(20., 60.)),
                   'loop_forward': float(rng.uniform(0.8, 1.0))},
                  {'loop_lag': lag}, parameters={'time_constant': lag})


def _coulomb_drivetrain(s: Setting, rng: Rng) -> Change:
    torque = draw(rng, s, (1.2, 1.8), (3.0, 5.0), (7.0, 11.0))
    side = pick(rng, 'left', 'right', 'both')
    return Change({**sided('friction', torque, side),
                   'stribeck_ratio': float(rng.uniform(1.0, 1.4)),
                   'stribeck_speed': float(rng.uniform(0.1, 0.6))},
                  side=side, parameters={'coulomb_torque': torque})


def _viscous_asymmetry(s: Setting, rng: Rng) -> Change:
    loss = draw(rng, s, (0.35, 0.55), (0.9, 1.5), (2.2, 3.5))
    side = pick(rng, 'left', 'right')
    return Change({**sided('viscous', loss, side),
                   'viscous_exponent': float(rng.uniform(0.85, 1.0))},
                  side=side, parameters={'extra_damping': loss})


def _belt_compliance(s: Setting, rng: Rng) -> Change:
    stiffness = draw(rng, s, (25.0, 40.0), (10.0, 16.0), (3.0, 6.0))
    return Change({'belt_stiffness': stiffness, 'belt_damping': float(rng.uniform(0.1, 0.5))},
                  side='both', parameters={'belt_stiffness': stiffness})


def _gear_backlash(s: Setting, rng: Rng) -> Change:
    gap = draw(rng, s, (0.03, 0.05), (0.1, 0.16), (0.3, 0.5))
    return Change({'gap': gap}, side='both', parameters={'gap': gap})


def _torque_ripple(s: Setting, rng: Rng) -> Change:
    torque = draw(rng, s, (0.8, 1.2), (2.0, 3.5), (5.0, 9.0))
    side = pick(rng, 'left', 'right', 'both')
    return Change({**sided('ripple', torque, side),
                   'ripple_phase': float(rng.uniform(0.0, 6.28))},
                  side=side, parameters={'ripple_amplitude': torque})


def _wheel_radius_mismatch(s: Setting, rng: Rng) -> Change:
    part = sign(rng) * draw(rng, s, (0.008, 0.012), (0.02, 0.035), (0.05, 0.08))
    side = pick(rng, 'left', 'right')
    name = f'radius_{side}'
    return Change({name: s.fields[name] * (1.0 + part)}, side=side,
                  parameters={'radius_change_fraction': part})


def _traction_saturation(s: Setting, rng: Rng) -> Change:
    force = draw(rng, s, (26.0, 34.0), (15.0, 21.0), (7.0, 11.0))
    if s.fields['tyre'] > 0.5:
        force *= 1.6
    return Change({'force_limit': force}, side='both', parameters={'wheel_force_limit': force})


def _payload(s: Setting, rng: Rng) -> Change:
    extra = draw(rng, s, (4.0, 6.0), (10.0, 18.0), (25.0, 40.0))
    inertia = extra * float(rng.uniform(0.2, 0.4)) ** 2
    return Change({'mass': s.fields['mass'] + extra,
                   'yaw_inertia': s.fields['yaw_inertia'] + inertia},
                  parameters={'extra_mass': extra, 'extra_inertia': inertia})


def _slope(s: Setting, rng: Rng) -> Change:
    angle = math.radians(draw(rng, s, (0.7, 1.0), (2.0, 3.2), (4.5, 7.0)))
    heading = float(rng.uniform(-math.pi, math.pi))
    pull = w.GRAVITY * math.sin(angle)
    return Change({'gravity_x': pull * math.cos(heading), 'gravity_y': pull * math.sin(heading)},
                  parameters={'slope_angle': angle, 'downhill_heading': heading})


def _rolling_resistance(s: Setting, rng: Rng) -> Change:
    force = draw(rng, s, (10.0, 15.0), (25.0, 42.0), (65.0, 100.0))
    return Change({'rolling': force}, parameters={'rolling_force': force})


def _quadratic_drag(s: Setting, rng: Rng) -> Change:
    drag = draw(rng, s, (18.0, 28.0), (45.0, 75.0), (120.0, 190.0))
    return Change({'drag': drag}, parameters={'drag_coefficient': drag})


def _yaw_scrub_coulomb(s: Setting, rng: Rng) -> Change:
    moment = draw(rng, s, (0.6, 0.9), (1.8, 3.2), (5.0, 8.0)) * (3.0 if s.heavy else 1.0)
    return Change({'scrub': moment}, parameters={'yaw_coulomb_moment': moment})


def _yaw_scrub_speed(s: Setting, rng: Rng) -> Change:
    part = draw(rng, s, (0.2, 0.3), (0.6, 1.0), (1.8, 3.0))
    size = part * (40.0 if s.heavy else 12.865) / max(s.most_forward, 0.3)
    return Change({'scrub_speed': size, 'scrub_exponent': float(rng.uniform(0.85, 1.3))},
                  parameters={'yaw_damping_per_speed': size})


def _yaw_pull(s: Setting, rng: Rng) -> Change:
    moment = draw(rng, s, (0.5, 0.8), (1.5, 2.6), (4.0, 7.0)) * sign(rng)
    moment *= 3.0 if s.heavy else 1.0
    return Change({'pull': moment}, side='left' if moment > 0 else 'right',
                  parameters={'pull_moment': moment})


def _terrain_change(s: Setting, rng: Rng) -> Change:
    factor = draw(rng, s, (1.25, 1.35), (1.6, 2.0), (2.6, 3.6))
    if rng.random() < 0.3:
        factor = 1.0 / factor
    creep = factor ** float(rng.uniform(-0.4, 0.4))
    return Change({'yaw_damping': s.fields['yaw_damping'] * factor,
                   'creep': s.fields['creep'] * creep,
                   'tyre_friction': s.fields['tyre_friction'] * factor ** 0.7},
                  parameters={'scrub_factor': factor, 'creep_factor': creep})


def _gyro_bias(s: Setting, rng: Rng) -> Change:
    bias = draw(rng, s, (0.005, 0.008), (0.015, 0.03), (0.05, 0.1)) * sign(rng)
    return Change(senses={'gyro_bias': bias}, parameters={'gyro_bias': bias})


def _gyro_scale(s: Setting, rng: Rng) -> Change:
    factor = 1.0 + draw(rng, s, (0.02, 0.03), (0.05, 0.09), (0.14, 0.25)) * sign(rng)
    return Change(senses={'gyro_factor': factor}, parameters={'gyro_factor': factor})


def _gyro_sign(s: Setting, rng: Rng) -> Change:
    return Change(senses={'gyro_factor': -1.0}, parameters={'gyro_factor': -1.0})


def _encoder_scale(s: Setting, rng: Rng) -> Change:
    factor = 1.0 + draw(rng, s, (0.015, 0.022), (0.04, 0.065), (0.1, 0.16)) * sign(rng)
    side = pick(rng, 'left', 'right')
    return Change(senses={f'encoder_{side}': factor}, side=side,
                  parameters={'encoder_factor': factor})


def _sensor_time_offset(s: Setting, rng: Rng) -> Change:
    late = draw(rng, s, (0.03, 0.05), (0.08, 0.13), (0.2, 0.35))
    return Change(senses={'late': pick(rng, 'imu', 'wheels', 'pose'), 'late_by': late},
                  parameters={'late_by': late})


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
