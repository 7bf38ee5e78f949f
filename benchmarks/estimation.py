# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
What estimating costs, as ratios within one run.

Run ``python benchmarks/estimation.py``; ``--quick`` takes smaller counts. Needs numba; the rows on
the engine need MuJoCo. Times are the best of several repetitions.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager
import os
import time

from lg_husky_sim.evaluation.cases import sensed
from lg_husky_sim.evaluation.engine import drive, engine_config, engine_robot
from lg_husky_sim.husky.model import compile_model, HuskyModel
from lg_husky_sim.husky.model_file import load_model, ModelFile
from lg_husky_sim.identification.estimate import estimate
from lg_husky_sim.identification.options import with_effects
from lg_husky_sim.identification.paper_objective import PaperObjective, PERIOD
from lg_husky_sim.identification.search import genetic
from lg_husky_sim.identification.simd_batch import batch_cost, operators
from lg_husky_sim.identification.unknowns import free_names, search_bounds
from lg_husky_sim.jit import SWITCH
from lg_husky_sim.manoeuvres import find_manoeuvre
from lg_husky_sim.recording import Segment, segments
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation import rollout, Simulator
from lg_husky_sim.simulation.compiling import compile_here
from lg_husky_sim.simulation.simulator import hold
import numba
import numpy as np
import scipy.linalg

#: Multiplications and additions of one step of one candidate in the batch kernel.
OPERATIONS = 8 * 7 + 12 + 2 * 20 + 18


def best(function: Callable[[], object], times: int = 3) -> float:
    """Return the shortest wall time of several calls [s]."""
    shortest = float('inf')
    for _ in range(times):
        began = time.perf_counter()
        function()
        shortest = min(shortest, time.perf_counter() - began)
    return shortest


def circle(seed: int = 0, truth: dict[str, float] | None = None) -> Segment:
    """Return a noisy circle of a robot that is not the nominal one."""
    model = load_model()
    values = truth or {'wheel_damping': 2.4, 'yaw_damping': 19.0, 'command_gain': 0.872}
    commands = find_manoeuvre('circle').commands()
    plant = compile_model(model.structure).at(model.parameters.replacing(values))
    path = plant.observe(rollout(plant, commands, float(commands.times[-1]), 0.02))
    config = engine_config()['sensors']
    return segments(sensed('circle', commands, path, np.random.default_rng(seed), config))[0]


def say(what: str, value: str, target: str = '') -> None:
    """Print one row."""
    print(f'{what:<72}{value:>22}   {target}', flush=True)


@contextmanager
def without_numba() -> Iterator[None]:
    """Switch the compiled kernels off."""
    os.environ[SWITCH] = '1'
    try:
        yield
    finally:
        del os.environ[SWITCH]


def numpy_steps(model: HuskyModel, nominal: ModelFile, part: Segment, count: int) -> float:
    """Return the time of one simulation by a loop of numpy products, one a step [s]."""
    objective = PaperObjective(model, nominal.parameters, free_names(nominal, ()), [part])
    track = objective.tracks[0]
    plant = model.at(nominal.parameters).sets[0]
    n, stage = plant.a.shape[0], plant.command
    block = np.zeros((n + 6, n + 6))
    block[:n, :n], block[:n, n + 4:] = plant.a, plant.b
    block[n:n + 4, :n] = plant.rows[:4]
    step = scipy.linalg.expm(block * PERIOD)[:n + 4]
    a, b = step[:, :n + 4], step[:, n + 4:]

    def once() -> None:
        x, pose = np.zeros(a.shape[0]), np.zeros(3)
        for forward, yaw in track.commands[:count]:
            u = np.clip(np.array([
                stage.volts_per_speed * forward - stage.volts_per_rate * yaw,
                stage.volts_per_speed * forward + stage.volts_per_rate * yaw]), -24.0, 24.0)
            new = a @ x + b @ u
            way, turn = new[-2] - x[-2], new[-1] - x[-1]
            pose += way * np.array([np.cos(pose[2] + 0.5 * turn),
                                    np.sin(pose[2] + 0.5 * turn), 0.0])
            pose[2] += turn
            x = new
    return best(once)


@numba.njit(fastmath=True)  # type: ignore[untyped-decorator]
def _flops(count: int, a: FloatArray) -> None:
    # Sixteen products and sums a load, so that arithmetic is the limit.
    for _ in range(count):
        for k in range(a.size):
            x = a[k]
            x = (((x * 0.9 + 0.1) * 0.9 + 0.1) * 0.9 + 0.1) * 0.9 + 0.1
            y = ((((x * x + 0.2) * 0.8 + x) * 0.7 + 0.1) * 0.6 + 0.1) * x + 0.3
            z = (((((x * y + 0.2) * 0.8 + y) * 0.7 + x) * 0.6 + y) * 0.3 + x) * y + 0.1
            a[k] = z * 0.1 + y


def flop_limit() -> float:
    """Return measured multiplications and additions per second of one core, in cache."""
    a = np.full(512, 0.5)
    _flops(1, a)
    count = 20_000
    return 2.0 * 16 * a.size * count / best(lambda: _flops(count, a), 5)


def genetic_rows(quick: bool) -> None:
    """Compare the genetic algorithm with its bare simulations and with numpy."""
    nominal, part = load_model(), circle()
    model = compile_model(nominal.structure)
    free = free_names(nominal, ())
    objective = PaperObjective(model, nominal.parameters, free, [part])
    lower, upper = search_bounds(nominal.parameters, free)
    found = genetic(objective, lower, upper, 0)
    draws = np.random.default_rng(0).uniform(lower, upper, (found.evaluations, lower.size))
    batches = np.array_split(draws, 101)

    def bare() -> None:
        for batch in batches:
            objective(batch)
    whole, simulations = best(lambda: genetic(objective, lower, upper, 0)), best(bare)
    steps = objective.steps
    say(f"paper's GA, {found.evaluations} simulations of {steps} steps", f'{whole:.3f} s')
    say('  over as many bare kernel simulations', f'{whole / simulations:.2f} ×', 'at most 1.5')
    count = 300 if quick else steps
    slow = numpy_steps(model, nominal, part, count) * steps / count * found.evaluations
    say('  the same with a numpy simulator that steps one by one (extrapolated)', f'{slow:.0f} s')
    say('  faster by', f'{slow / whole:.0f} ×', 'at least 100')
    with without_numba():
        plain = best(lambda: objective(draws[:100]))
    say('  numpy on all candidates at once (no numba), whole GA',
        f'{plain * found.evaluations / 100:.1f} s')


def estimator_rows(quick: bool) -> None:
    """Compare least squares with the genetic algorithm over seeds and random starts."""
    nominal = load_model()
    truth = {'wheel_damping': 2.4, 'yaw_damping': 19.0, 'command_gain': 0.872}
    seeds = range(3 if quick else 20)
    rows: dict[str, list[tuple[float, int, float]]] = {'ga': [], 'least-squares': []}
    for seed in seeds:
        part = circle(seed, truth)
        for method in rows:
            from lg_husky_sim.identification.result import Method
            result = estimate(nominal, [part], method=Method(method), seed=seed, starts=1)
            error = max(abs(result.values[n] / v - 1.0) for n, v in truth.items())
            rows[method].append((result.seconds, result.evaluations, error))
    for method, runs in rows.items():
        seconds, evaluations, error = (np.median(column) for column in zip(*runs, strict=True))
        say(f'{method}: median of {len(runs)} seeds',
            f'{seconds:.2f} s, {evaluations:.0f} sim.', f'largest error {100 * error:.1f} %')
    total, reached = 0, 0
    for seed in seeds:
        result = estimate(nominal, [circle(seed, truth)], seed=seed, starts=3)
        for start in result.starts[1:]:
            total += 1
            reached += all(abs(start.values[n] / v - 1.0) < 0.1 for n, v in truth.items())
    say('least squares: random starts that reach the truth (each within 10 %)',
        f'{reached} of {total}', 'at least 38 of 40')


def engine_rows(quick: bool) -> None:
    """Compare the kernels with MuJoCo."""
    nominal, part = load_model(), circle()
    model = compile_model(nominal.structure)
    commands = find_manoeuvre('circle').commands()
    duration = float(commands.times[-1])
    robot = engine_robot('nominal')
    engine = best(lambda: drive(robot, commands), 1 if quick else 3) / duration
    free = free_names(nominal, ())
    objective = PaperObjective(model, nominal.parameters, free, [part])
    lower, upper = search_bounds(nominal.parameters, free)
    draws = np.random.default_rng(0).uniform(lower, upper, (1600, lower.size))
    objective(draws[:16])
    batch = best(lambda: objective(draws), 5) / (1600 * objective.steps * PERIOD)
    say(f'MuJoCo, step {robot.timestep * 1e3:g} ms, per second of drive', f'{engine * 1e3:.2f} ms')
    say('  over the batch kernel', f'{engine / batch:.0f} ×', 'at least 10000')
    full = with_effects(nominal, [
        'battery_sag', 'coulomb_drivetrain', 'rolling_resistance', 'yaw_scrub_coulomb',
        'traction_saturation', 'quadratic_drag'])
    plant = compile_model(full.structure).at(full.parameters)
    simulator = Simulator(plant, PERIOD, fine_pose=False)
    held = hold(commands, 0.0, PERIOD, int(duration / PERIOD))
    state = simulator.initial()
    simulator.run(state, held)
    alone = best(lambda: simulator.run(state, held), 5) / duration
    say('  over one run of the non-linear kernel with six effects', f'{engine / alone:.0f} ×',
        'at least 500')
    modes = objective._decoupling(draws) if objective._decoupling else None
    assert modes is not None
    op = operators(modes, PERIOD)
    track = objective.tracks[0]

    def simulate() -> FloatArray:
        return batch_cost(op, modes.stage, np.zeros(9), track.commands, track.steps,
                          track.shares, track.targets)
    seconds = best(simulate, 5)
    rate = OPERATIONS * 1600 * objective.steps / seconds
    limit = flop_limit()
    say('batch kernel, per step of a candidate', f'{seconds / 1600 / objective.steps * 1e9:.2f} '
        'ns', f'{1600 / seconds:.0f} circles/s')
    say('  share of the measured flop limit of a core', f'{100 * rate / limit:.0f} %',
        f'limit {limit * 1e-9:.1f} GFLOP/s')


def growth_rows() -> None:
    """Show how the batch grows with steps, candidates and recordings."""
    nominal = load_model()
    model = compile_model(nominal.structure)
    free = free_names(nominal, ())
    lower, upper = search_bounds(nominal.parameters, free)
    draws = np.random.default_rng(0).uniform(lower, upper, (6400, lower.size))
    one = PaperObjective(model, nominal.parameters, free, [circle()])
    for recordings in (1, 2, 4, 8):
        objective = PaperObjective(model, nominal.parameters, free, [circle()] * recordings)
        seconds = best(lambda: objective(draws[:400]))  # noqa: B023
        say(f'growth: {recordings} recordings, {objective.steps} steps, 400 candidates',
            f'{seconds * 1e3:.1f} ms', f'{seconds / objective.steps / 400 * 1e9:.1f} ns a step')
    for count in (16, 100, 400, 1600, 6400):
        seconds = best(lambda: one(draws[:count]))  # noqa: B023
        say(f'growth: {count} candidates', f'{seconds * 1e3:.2f} ms',
            f'{seconds / one.steps / count * 1e9:.1f} ns a step')


def main() -> None:
    """Print all rows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--quick', action='store_true')
    quick = parser.parse_args().quick
    compile_here()
    genetic_rows(quick)
    estimator_rows(quick)
    engine_rows(quick)
    growth_rows()


if __name__ == '__main__':
    main()
