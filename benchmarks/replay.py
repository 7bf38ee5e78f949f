# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a headless replay costs, as ratios within one run.

Run ``python benchmarks/replay.py``: 60 s of commands at 50 Hz through the paper's Husky, by the
compiled kernel, by a numpy loop over exact operators of a step, by the same kernel in plain Python
and by MuJoCo with a simple Husky (box, four wheels, two motors with back-EMF, steps of 2 ms); and
60 s of commands at 20 Hz read at the stamps of all sensors, with and without effects. Times are of
the processor, best of several repetitions; the rows on MuJoCo need it, the first needs numba.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
import os
import subprocess
import sys
import time
from typing import Any

from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.jit import compiled, SWITCH
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.simulation import Simulator
from lg_husky_sim.simulation.compiling import compile_here
from lg_husky_sim.simulation.events import Events, Propagator
import numpy as np
import scipy.linalg

PERIOD = 0.02
DURATION = 60.0
TIMESTEP = 0.002
"""MuJoCo's step [s]."""


def best(function: Callable[[], object], times: int) -> float:
    """Return the shortest processor time of several calls [s]."""
    shortest = float('inf')
    for _ in range(times):
        began = time.thread_time()
        function()
        shortest = min(shortest, time.thread_time() - began)
    return shortest


def commands() -> FloatArray:
    """Return 60 s of commands that change every second, with turns on the spot and reverses."""
    generator = np.random.default_rng(0)
    return np.repeat(generator.uniform((-0.6, -0.5), (0.8, 0.5), (int(DURATION), 2)),
                     round(1.0 / PERIOD), axis=0)


def nominal() -> tuple[Plant, Parameters]:
    """Return the paper's Husky."""
    model = load_model()
    return compile_model(model.structure).at(model.parameters), model.parameters


def numpy_loop(plant: Plant, held: FloatArray) -> FloatArray:
    """
    Step the linear plant by numpy products, one step at a time.

    Exact hold with the angles, distance and heading in it, x and y by the arc of each step; every
    column of the kernel's output.
    """
    one = plant.sets[0]
    n, stage = one.a.shape[0], one.command
    block = np.zeros((n + 6, n + 6))
    block[:n, :n], block[:n, n + 4:] = one.a, one.b
    block[n:n + 4, :n], block[n:n + 4, n + 4:] = one.rows[:4], one.rows_u[:4]
    step = scipy.linalg.expm(block * PERIOD)[:n + 4]
    outputs = np.hstack([one.rows, one.rows_u])
    gains = np.array([[stage.volts_per_speed, -stage.volts_per_rate],
                      [stage.volts_per_speed, stage.volts_per_rate]])
    x, place = np.zeros(n + 4), np.zeros(2)
    out = np.empty((len(held), 15))
    for index, command in enumerate(held):
        u = np.clip(gains @ command, -stage.clamp, stage.clamp)
        new = step @ np.concatenate([x, u])
        turn = 0.5 * (new[n + 3] - x[n + 3])
        chord = (new[n + 2] - x[n + 2]) * np.sinc(turn / np.pi)
        place[0] += chord * np.cos(x[n + 3] + turn)
        place[1] += chord * np.sin(x[n + 3] + turn)
        x = new
        y = outputs @ np.concatenate([x[:n], u])
        out[index, :7], out[index, 7:11] = y[:7], x[n:]
        out[index, 11:13], out[index, 13:] = place, y[7:]
    return out


def difference(one: FloatArray, other: FloatArray) -> float:
    """Return the largest difference in units of each column's largest value."""
    scale = np.maximum(np.abs(other).max(axis=0), 1e-3)
    return float((np.abs(one - other) / scale).max())


def mjcf(values: Parameters) -> str:
    """
    Return a simple Husky: box, four wheels, a motor a side with back-EMF, belts, a plane.

    A motor of voltage V turns its two wheels with T (V - T w)/R in all; the winding's inductance
    is left out, as an engine with steps of 2 ms must.
    """
    transmission = values['torque_constant'] * values['gear_ratio']
    gain = 0.5 * transmission / values['motor_resistance']
    radius, wheels, motors, belts = values['wheel_radius'], '', '', ''
    inertia = 0.5 * values['wheel_inertia']
    for left, side in ((1, 'left'), (-1, 'right')):
        for ahead, end in ((1, 'front'), (-1, 'rear')):
            name = f'{end}_{side}'
            wheels += (
                f'<body name="{name}" pos="{0.5 * ahead * values["wheelbase"]} '
                f'{0.5 * left * values["track"]} 0"><joint name="{name}" axis="0 1 0"/>'
                f'<inertial pos="0 0 0" mass="2.6" diaginertia="0.02 {inertia} 0.02"/>'
                f'<geom type="cylinder" size="{radius} 0.057" zaxis="0 1 0"/></body>\n')
            motors += (f'<general name="{name}" joint="{name}" gaintype="fixed" gainprm="{gain}" '
                       f'biastype="affine" biasprm="0 0 {-gain * transmission}"/>\n')
        belts += f'<joint joint1="front_{side}" joint2="rear_{side}" polycoef="0 1 0 0 0"/>\n'
    body = values['mass'] - 4 * 2.6
    return f"""<mujoco><option timestep="{TIMESTEP}" integrator="implicitfast"/>
<default><geom friction="0.6 0.005 0.0001" condim="3"/></default>
<worldbody><geom type="plane" size="0 0 1"/>
<body pos="0 0 {radius}"><freejoint/>
<inertial pos="0 0 0.05" mass="{body}" diaginertia="1 2 {0.8 * values['yaw_inertia']}"/>
<geom type="box" size="0.45 0.2 0.1" pos="0 0 0.12" contype="0" conaffinity="0"/>
{wheels}</body></worldbody>
<equality>{belts}</equality>
<actuator>{motors}</actuator></mujoco>"""


def engine_drive(mujoco: Any, model: Any, plant: Plant, held: FloatArray) -> float:
    """Drive MuJoCo with the voltages of the commands; return the distance that was covered [m]."""
    stage = plant.sets[0].command
    data = mujoco.MjData(model)
    inner = round(PERIOD / TIMESTEP)
    covered, before = 0.0, np.array(data.qpos[:2])
    for forward, yaw in held:
        speed, rate = stage.volts_per_speed * forward, stage.volts_per_rate * yaw
        data.ctrl[:2], data.ctrl[2:] = speed - rate, speed + rate
        mujoco.mj_step(model, data, inner)
        now = np.array(data.qpos[:2])
        covered, before = covered + float(np.hypot(*(now - before))), now
    if not np.all(np.isfinite(data.qpos)):
        raise RuntimeError('MuJoCo diverged')
    return covered


def say(what: str, seconds: float, ratio: float | None = None, target: str = '') -> None:
    """Print one row of the table."""
    steps = round(DURATION / PERIOD)
    text = '' if ratio is None else f'{ratio:,.0f} ×'
    print(f'{what:<62}{seconds * 1e3:>12.3f} ms{seconds / steps * 1e6:>11.3f} µs{text:>12}  '
          f'{target}', flush=True)


def plain_seconds() -> float:
    """Return the time of this kernel without numba, in a process of its own [s]."""
    done = subprocess.run([sys.executable, os.path.abspath(__file__), '--kernel-only'],
                          env={**os.environ, SWITCH: '1'}, capture_output=True, text=True,
                          check=True)
    return float(done.stdout.split()[-1])


def replay_rows(repetitions: int) -> tuple[float, float]:
    """Compare the kernel with numpy; return its times with panels and with arcs [s]."""
    plant, _ = nominal()
    held = commands()
    times = []
    for fine, pose in ((True, 'x and y by panels'), (False, 'x and y by arcs')):
        propagator, grid = Propagator(plant), PERIOD * np.arange(len(held) + 1)
        events = Events(TimeSeries(grid[:-1], held, ('forward', 'yaw')), grid[1:])
        start = propagator.initial()
        out = propagator.run(events, start, fine_pose=fine)
        kernel = best(lambda: propagator.run(events, start, fine_pose=fine),  # noqa: B023
                      40 * repetitions)
        reference = numpy_loop(plant, held)
        slow = best(lambda: numpy_loop(plant, held), repetitions)
        places = [11, 12] if fine else []  # arcs are no reference for panels
        apart = difference(np.delete(out, places, axis=1), np.delete(reference, places, axis=1))
        say(f'kernel, {pose}', kernel)
        say('  numpy, one step at a time', slow, slow / kernel, 'at least 50')
        print(f'  largest difference of any column, of its range: {apart:.1e}   at most 1e-9')
        if apart > 1e-9:
            raise SystemExit('the kernel and the reference path differ')
        times.append(kernel)
    simulator = Simulator(plant, PERIOD, fine_pose=False)
    begin = simulator.initial()
    say('  live, one step at a time', best(lambda: simulator.run(begin, held), repetitions))
    return times[0], times[1]


def sensor_rows(repetitions: int) -> None:
    """Time 60 s of commands at 20 Hz, read at the stamps of wheels, pose (50 Hz) and gyro."""
    draws = np.random.default_rng(0)
    stamps = 0.05 * np.arange(1200) + draws.uniform(0.0, 0.004, 1200)
    smooth = np.column_stack([0.4 + 0.4 * np.sin(0.3 * stamps) * np.sin(0.11 * stamps),
                              0.5 * np.sin(0.23 * stamps + 1.0)])
    jumps = np.repeat(draws.uniform((-0.6, -0.5), (0.8, 0.5), (60, 2)), 20, axis=0)
    times = np.concatenate([0.02 * np.arange(1, 3000) + 0.0031, 0.02 * np.arange(1, 3000)
                            + draws.uniform(0.0, 0.004, 2999), 0.01 * np.arange(1, 6000)])
    for effects, target in (
            ((), 'at most 2 ms'), (('command_latency', 'command_slew'), 'at most 2 ms'),
            (('belt_compliance',), ''), (('current_limit',), ''), (('gear_backlash',), ''),
            (('rolling_resistance', 'coulomb_drivetrain', 'yaw_scrub_coulomb'), 'at most 6 ms'),
            (('gear_backlash', 'coulomb_drivetrain', 'current_limit'), 'at most 6 ms')):
        structure = Structure()
        for name in effects:
            structure = structure.with_effect(Effect(name))
        own = [p.parameter() for effect in structure.effects for p in effect.parameters()]
        plant = compile_model(structure).at(load_model().parameters.with_entries(*own))
        drive = Propagator(plant)
        for kind, values in (('joystick', smooth), ('jumps each second', jumps)):
            events = Events(TimeSeries(stamps, values, ('forward', 'yaw')), times, start=0.0)
            start = drive.initial()
            seconds = best(lambda: drive.run(events, start, fine_pose=False),  # noqa: B023
                           10 * repetitions)
            print(f'{", ".join(effects) or "linear":<62}{seconds * 1e3:>12.2f} ms  {kind:<18}'
                  f'{target}', flush=True)


def main() -> None:
    """Print all rows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--quick', action='store_true', help='fewer repetitions')
    parser.add_argument('--kernel-only', action='store_true', help='print the time alone')
    arguments = parser.parse_args()
    compile_here()
    plant, values = nominal()
    if arguments.kernel_only:
        simulator, held = Simulator(plant, PERIOD), commands()
        print(best(lambda: simulator.run(simulator.initial(), held), 1))
        return
    repetitions = 3 if arguments.quick else 8
    print(f'{"60 s at 50 Hz":<62}{"whole":>15}{"a step":>14}{"ratio":>12}')
    kernel, arcs = replay_rows(repetitions)
    sensor_rows(repetitions)
    if compiled():
        plain = plain_seconds()
        say('kernel in plain Python, over the compiled one', plain, plain / kernel)
    else:
        print('numba is not installed: the kernel above is plain Python '
              "(pip install 'lg_husky_sim[fast]')")
    try:
        import mujoco
    except ImportError:
        print("MuJoCo is not installed: its row is left out (pip install 'lg_husky_sim[engine]')")
        return
    model = mujoco.MjModel.from_xml_string(mjcf(values))
    held = commands()
    covered = engine_drive(mujoco, model, plant, held)
    seconds = best(lambda: engine_drive(mujoco, model, plant, held), repetitions)
    say(f'MuJoCo, simple Husky, steps of {TIMESTEP * 1e3:g} ms, over the arcs', seconds,
        seconds / arcs, 'at least 2,000')
    say('  the same, over the panels', seconds, seconds / kernel)
    distance = np.abs(np.diff(numpy_loop(plant, held)[:, 9])).sum()
    print(f'  way covered: MuJoCo {covered:.1f} m, kernel {distance:.1f} m')


if __name__ == '__main__':
    main()
