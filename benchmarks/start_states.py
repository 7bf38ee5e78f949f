# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
What it brings to estimate the state at the start of each segment.

Run ``python benchmarks/start_states.py``: synthetic segments that begin in motion, with a pose and
without. With ``--real BAG`` a recording is cut into windows of 5 s, whose estimates are compared
with those of the recording as a whole.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
import itertools

from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.identification.estimate import estimate
from lg_husky_sim.identification.options import with_effects
from lg_husky_sim.recording import read_recording, Segment, segments
from lg_husky_sim.recording.recording import cut, windows
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.simulation import rollout
import numpy as np
from tqdm import tqdm

TRUTH = {'wheel_damping': 1.0, 'yaw_damping': 9.0, 'command_gain': 0.85}
COUNT, LENGTH, STEP = 40, 2.0, 1.3
CASES = {'wheels, gyro and pose': ('command', 'wheels', 'imu', 'pose'),
         'wheels and gyro': ('command', 'wheels', 'imu'),
         'gyro and pose': ('command', 'imu', 'pose')}
CHOICES: tuple[tuple[str, ...], ...] = ((), ('initial_state',))
EFFECTS = ('speed_loop', 'command_latency', 'command_slew', 'command_limit:yaw')
FREE = ('wheel_damping', 'yaw_damping', 'command_gain', 'turn_ratio', 'loop_lag', 'latency',
        'slew_forward', 'slew_yaw', 'limit_yaw')


def moving(seed: int, kept: Sequence[str]) -> list[Segment]:
    """Return the segments of a random drive, cut in full motion, with sensor noise."""
    draws = np.random.default_rng(seed)
    model = load_model()
    plant = compile_model(model.structure).at(model.parameters.replacing(TRUTH))
    times = np.arange(0.0, 1.0 + COUNT * LENGTH, 0.05)
    place = (times / STEP).astype(int)
    levels = draws.uniform((0.0, -1.0), (1.0, 1.0), (place[-1] + 1, 2))
    commands = TimeSeries(times, levels[place], ('forward', 'yaw'))
    seen = plant.observe(rollout(plant, commands, float(times[-1]), 0.02))

    def noisy(names: tuple[str, ...], deviations: Sequence[float]) -> FloatArray:
        values = np.column_stack([seen.column(name) for name in names])
        made: FloatArray = values + draws.normal(0.0, 1.0, values.shape) * deviations
        return made
    imu = np.column_stack([noisy(('yaw_rate',), (0.02,)), np.zeros((len(seen), 2))])
    streams = {
        'command': commands,
        'wheels': TimeSeries(seen.times, noisy(('wheel_left', 'wheel_right'), (0.1, 0.1)),
                             ('left', 'right')),
        'imu': TimeSeries(seen.times, imu, ('yaw_rate', 'accel_x', 'accel_y')),
        'pose': TimeSeries(seen.times, noisy(('x', 'y', 'heading'), (0.02, 0.02, 0.01)),
                           ('x', 'y', 'heading'))}
    streams = {name: streams[name] for name in kept}
    starts = [1.0 + number * LENGTH for number in range(COUNT)]
    return [Segment('drive', number, start, start + LENGTH, cut(streams, start, start + LENGTH))
            for number, start in enumerate(starts)]


def synthetic(count: int) -> None:
    """Print errors, coverage and time over recordings."""
    print('| recorded | starts | parameter | median error | intervals that hold | time |')
    print('| --- | --- | --- | --- | --- | --- |')
    for (label, kept), nuisance in itertools.product(CASES.items(), CHOICES):
        fits = [estimate(load_model(), moving(seed, kept), nuisance=nuisance, starts=1)
                for seed in tqdm(range(count), leave=False)]
        for place, name in enumerate(fits[0].values):
            ones = [fit.estimates[place] for fit in fits]
            error = np.median([abs(one.value / TRUTH[name] - 1.0) for one in ones])
            inside = sum(one.low < TRUTH[name] < one.high for one in ones)
            seconds = np.median([fit.seconds for fit in fits])
            print(f'| {label} | {"estimated" if nuisance else "measured"} | {name} | '
                  f'{100 * error:.2f} % | {inside} of {count} | {seconds:.2f} s |')


def real(path: str) -> None:
    """Print the estimates of a recording as a whole, and of its windows."""
    whole = segments(read_recording(path))
    short = [replace(part, index=number) for number, part in enumerate(
        part for one in whole for part in windows(one, 5.0))]
    model = with_effects(load_model(), EFFECTS)
    for label, parts, nuisance in (('whole', whole, CHOICES[0]), *(
            ('windows', short, choice) for choice in CHOICES)):
        fit = estimate(model, parts, free=FREE, nuisance=nuisance)
        print(f'\n{label}, starts {"estimated" if nuisance else "measured"}\n{fit}')


def main() -> None:
    """Run as the docs say."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--count', type=int, default=20, help='synthetic recordings')
    parser.add_argument('--real', metavar='BAG', help='a recording to cut in windows in place')
    arguments = parser.parse_args()
    if arguments.real:
        real(arguments.real)
    else:
        synthetic(arguments.count)


if __name__ == '__main__':
    main()
