# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
What many simulations of one drive cost, in simulations of it: ratios within one run.

Run ``python benchmarks/batches.py``; needs numba. Derivatives by 15 parameters, 64 sets of
parameters, and drives with more and more events. Times are of the processor, best of several.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
import time

from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model, HuskyModel, Structure
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.identification.tracking import TrackingObjective
from lg_husky_sim.identification.unknowns import free_names, search_bounds
from lg_husky_sim.manoeuvres import find_manoeuvre
from lg_husky_sim.recording import Segment
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.simulation.compiling import compile_here
from lg_husky_sim.simulation.events import Events, Propagator
from lg_husky_sim.simulation.simulator import rollout
import numpy as np

#: By which the derivatives are taken, in relative steps of STEP.
PARAMETERS = (
    'wheel_damping', 'yaw_damping', 'mass', 'yaw_inertia', 'wheel_inertia', 'motor_resistance',
    'motor_inductance', 'torque_constant', 'gear_ratio', 'wheel_radius', 'track', 'command_gain',
    'supply_voltage', 'turn_ratio', 'wheelbase')
STEP = 1e-4
SETS = 64


def best(function: Callable[[], object], times: int) -> float:
    """Return the shortest processor time of several calls [s]."""
    shortest = float('inf')
    for _ in range(times):
        began = time.thread_time()
        function()
        shortest = min(shortest, time.thread_time() - began)
    return shortest


def drive(seconds: float, rate: float = 1.0) -> Events:
    """Return commands at 20 Hz, wheels and pose at 50 Hz and a gyro at 100 Hz, times a rate."""
    draws = np.random.default_rng(0)
    count = round(20 * rate * seconds)
    stamps = seconds * np.arange(count) / count
    values = np.column_stack([0.4 + 0.4 * np.sin(0.3 * stamps) * np.sin(0.11 * stamps),
                              0.5 * np.sin(0.23 * stamps + 1.0)])
    times = np.concatenate([np.sort(draws.uniform(0.0, seconds, round(hertz * rate * seconds)))
                            for hertz in (50, 50, 100)])
    return Events(TimeSeries(stamps, values, ('forward', 'yaw')), times, start=0.0)


def model_with(*effects: str) -> tuple[HuskyModel, Parameters]:
    """Return the paper's Husky with effects at their first sizes."""
    structure = Structure()
    for name in effects:
        structure = structure.with_effect(Effect(name))
    own = [p.parameter() for effect in structure.effects for p in effect.parameters()]
    return compile_model(structure), load_model().parameters.with_entries(*own)


def simulated(model: HuskyModel, parameters: Parameters, events: Events) -> FloatArray:
    """Put numbers in and drive."""
    propagator = Propagator(model.at(parameters))
    return propagator.run(events, propagator.initial(), fine_pose=False)


def derivative_rows(repetitions: int) -> None:
    """Compare derivatives by 15 parameters with one simulation."""
    events = drive(60.0)
    for effects in ((), ('rolling_resistance', 'coulomb_drivetrain', 'yaw_scrub_coulomb')):
        model, parameters = model_with(*effects)
        names = [name for name in PARAMETERS if name in parameters]
        moved = [parameters.replacing({name: parameters[name] * (1.0 + STEP)}) for name in names]

        def derivatives() -> list[FloatArray]:
            plain = simulated(model, parameters, events)  # noqa: B023
            return [simulated(model, there, events) - plain for there in moved]  # noqa: B023
        once = best(lambda: simulated(model, parameters, events), 8 * repetitions)  # noqa: B023
        several = best(derivatives, repetitions)
        say(f'60 s, {", ".join(effects) or "linear"}', f'{once * 1e3:.2f} ms')
        ratio = several / once
        say(f'  derivatives by {len(names)} parameters, by differences', f'{ratio:.1f} ×',
            f'at most 4{"" if ratio <= 4.0 else ": missed"}')


def batch_rows(repetitions: int) -> None:
    """Compare 64 sets of parameters side by side with one after the other."""
    nominal = load_model()
    model, free = compile_model(nominal.structure), free_names(nominal, ())
    commands = find_manoeuvre('circle').commands()
    end = float(commands.times[-1])
    path = rollout(model.at(nominal.parameters), commands, end)
    pose = TimeSeries(path.times[1::2], path.values[1::2][:, [
        path.names.index(name) for name in ('x', 'y', 'heading')]], ('x', 'y', 'heading'))
    objective = TrackingObjective(model, nominal.parameters, free, [
        Segment('circle', 0, 0.0, end, {'command': commands, 'pose': pose})])
    draws = np.random.default_rng(0).uniform(*search_bounds(nominal.parameters, free),
                                             (SETS, len(free)))
    events = Events(commands, pose.times)
    sets = [nominal.parameters.replacing(dict(zip(free, map(float, row), strict=True)))
            for row in draws]
    batch = best(lambda: objective(draws), 8 * repetitions)
    say(f'{SETS} sets of parameters, {end:.0f} s of poses, side by side', f'{batch * 1e3:.2f} ms')
    for what, one in (
            ('each by the same kernel', lambda: [objective(row[None]) for row in draws]),
            ('each by the event-driven kernel',
             lambda: [simulated(model, values, events) for values in sets])):
        ratio = best(one, repetitions) / batch
        say(f'  {what}', f'{ratio:.1f} ×', f'at least 8{"" if ratio >= 8.0 else ": missed"}')


def event_rows(repetitions: int) -> None:
    """Show that the cost of a drive grows with its events, and not with its length."""
    for effects in ((), ('coulomb_drivetrain',)):
        model, parameters = model_with(*effects)
        propagator = Propagator(model.at(parameters))
        for seconds, rate in ((60.0, 0.5), (60.0, 1.0), (60.0, 2.0), (60.0, 4.0), (240.0, 1.0)):
            events = drive(seconds, rate)
            count = events.stamps.size + events.times.size
            cost = best(lambda: propagator.run(  # noqa: B023
                events, propagator.initial(), fine_pose=False), 8 * repetitions)  # noqa: B023
            say(f'{", ".join(effects) or "linear"}: {count} events in {seconds:.0f} s',
                f'{cost * 1e3:.2f} ms', f'{cost / count * 1e9:.0f} ns an event')


def say(what: str, value: str, target: str = '') -> None:
    """Print one row."""
    print(f'{what:<66}{value:>12}   {target}', flush=True)


def main() -> None:
    """Print all rows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--quick', action='store_true', help='fewer repetitions')
    repetitions = 2 if parser.parse_args().quick else 8
    compile_here()
    derivative_rows(repetitions)
    batch_rows(repetitions)
    event_rows(repetitions)


if __name__ == '__main__':
    main()
