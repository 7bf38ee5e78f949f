# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Error of the event-driven simulation, effect by channel, in parts of the sensors' noise.

Random commands at random stamps, output at random times, against scipy's Radau at tight
tolerances::

    python benchmarks/accuracy.py [SECONDS [SEED]]
"""

from __future__ import annotations

import sys

from lg_husky_sim.husky.effects import catalogue, Effect
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.simulation.events import trajectory
from lg_husky_sim.testing.radau import NOISE, Reference
import numpy as np

#: Effects that the reference does not integrate: an onset is tested as an event.
APART = ('terrain_change',)


def errors(plant: Plant, seconds: float, seed: int) -> FloatArray:
    """Return the largest error of each channel of NOISE over a random drive [of the noise]."""
    draws = np.random.default_rng(seed)
    stamps = np.cumsum(draws.exponential(0.15, int(seconds / 0.15) + 2))
    commands = TimeSeries(stamps - stamps[0], draws.uniform(-0.9, 0.9, (stamps.size, 2)),
                          ('forward', 'yaw'))
    times = np.sort(draws.uniform(0.0, seconds, 200))
    expected = Reference(plant).trajectory(commands, times)
    seen = trajectory(plant, commands, times)
    worst: FloatArray = np.array([
        np.abs(seen.column(name) - expected.column(name)).max() / noise
        for name, noise in NOISE.items()])
    return worst


def plant_with(effect: Effect | None) -> Plant:
    """Return the paper's Husky with an effect at its first size."""
    structure = Structure() if effect is None else Structure().with_effect(effect)
    own = [p.parameter() for e in structure.effects for p in e.parameters()]
    return compile_model(structure).at(load_model().parameters.with_entries(*own))


def main(seconds: float = 4.0, seed: int = 0) -> None:
    """Print the table."""
    print(f'largest error in % of the noise of a sensor, {seconds:g} s, seed {seed}')
    print(f'{"effect":44s}' + ''.join(f'{name:>13s}' for name in NOISE))
    effects = [Effect(name, side, shape) for name, kind in catalogue().items()
               for side in kind.sides for shape in kind.shapes if name not in APART]
    for effect in [None, *effects]:
        label = 'nominal' if effect is None else ' '.join(
            part for part in (effect.id, effect.side, effect.shape) if part not in ('none', ''))
        worst = errors(plant_with(effect), seconds, seed)
        print(f'{label:44s}' + ''.join(f'{100.0 * value:13.2g}' for value in worst), flush=True)


if __name__ == '__main__':
    main(*(kind(text) for kind, text in zip((float, int), sys.argv[1:], strict=False)))
