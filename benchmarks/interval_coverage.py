# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
How often the 95 % intervals of `identify` contain the truth, over synthetic recordings.

Run ``python benchmarks/interval_coverage.py --count 200``. Every recording is the paper's circle,
driven by a robot of random dampings and command gain, once with white sensor noise and once with
noise that is correlated over half a second on top of it.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace

from lg_husky_sim.evaluation.cases import sensed
from lg_husky_sim.evaluation.engine import engine_config
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.identification.estimate import estimate
from lg_husky_sim.manoeuvres import find_manoeuvre
from lg_husky_sim.parallel import run_tasks
from lg_husky_sim.recording import Recording, segments
from lg_husky_sim.signals import TimeSeries
from lg_husky_sim.simulation import rollout
import numpy as np
from scipy.signal import lfilter
from scipy.stats import beta
from tqdm import tqdm

#: Ranges of the truth, even in the logarithm.
TRUTH = {'wheel_damping': (1.2, 8.0), 'yaw_damping': (10.0, 40.0), 'command_gain': (0.8, 0.95)}
#: Time over which the second kind of noise is correlated [s], and its size against the white one.
CORRELATED, SHARE = 0.5, 0.5


@dataclass(frozen=True)
class Task:
    """One recording: its seed, and whether its noise is correlated."""

    seed: int
    correlated: bool


def recording(task: Task) -> tuple[dict[str, float], Recording]:
    """Return a random truth and a noisy recording of its circle."""
    draws = np.random.default_rng(task.seed)
    truth = {name: float(np.exp(draws.uniform(np.log(low), np.log(high))))
             for name, (low, high) in TRUTH.items()}
    model = load_model()
    commands = find_manoeuvre('circle').commands()
    plant = compile_model(model.structure).at(model.parameters.replacing(truth))
    path = plant.observe(rollout(plant, commands, float(commands.times[-1]), 0.02))
    sensors = engine_config()['sensors']
    seen = sensed('circle', commands, path, draws, sensors)
    if not task.correlated:
        return truth, seen
    streams = dict(seen.streams)
    for name, columns, level in (('wheels', 2, sensors['wheel']), ('imu', 1, sensors['gyro'])):
        series = streams[name]
        pole = np.exp(-0.02 / CORRELATED)
        white = draws.normal(0.0, SHARE * level * np.sqrt(1.0 - pole ** 2), (len(series), columns))
        values = np.array(series.values)
        values[:, :columns] += lfilter([1.0], [1.0, -pole], white, axis=0)
        streams[name] = TimeSeries(series.times, values, series.names)
    return truth, replace(seen, streams=streams)


def covered(task: Task) -> dict[str, tuple[bool, float]]:
    """Return for each parameter whether its interval holds the truth, and its relative error."""
    truth, seen = recording(task)
    result = estimate(load_model(), segments(seen), seed=task.seed, starts=1)
    return {one.name: (one.low <= truth[one.name] <= one.high,
                       abs(one.value / truth[one.name] - 1.0)) for one in result.estimates}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--count', type=int, default=200)
    parser.add_argument('--jobs', type=int, default=1)
    arguments = parser.parse_args()
    print(f'{"noise":<12}{"parameter":<16}{"contained":>12}{"share":>8}'
          f'{"95 % range of the share":>26}{"median error":>14}')
    for correlated in (False, True):
        tasks = [Task(seed, correlated) for seed in range(arguments.count)]
        with tqdm(total=len(tasks), disable=None, leave=False) as bar:
            def tell() -> None:
                bar.update()
            found = run_tasks(covered, tasks, arguments.jobs, None, tell)
        for name in TRUTH:
            hits = sum(one[name][0] for one in found)
            total = len(found)
            low = beta.ppf(0.025, hits, total - hits + 1) if hits else 0.0
            high = beta.ppf(0.975, hits + 1, total - hits) if hits < total else 1.0
            error = float(np.median([one[name][1] for one in found]))
            print(f'{"correlated" if correlated else "white":<12}{name:<16}{hits:>5} of {total:<4}'
                  f'{hits / total:>8.3f}{f"{low:.3f} to {high:.3f}":>26}{100 * error:>12.2f} %')


if __name__ == '__main__':
    main()
