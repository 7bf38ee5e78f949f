# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
How much voltage motors get where commands ask for more than the model's supply.

A pack of 24 V has 22 V to 28 V, and a converter may give more. With a supply S' in place of S and
a command gain c S / S', every command is the voltage that it was, and the limit is another.
"""

from __future__ import annotations

from collections.abc import Sequence
import math

from lg_husky_sim.diagnosis.evidence.drives import Drive
from lg_husky_sim.diagnosis.evidence.evidence import evidence_of
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning, Point
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.threads import Threads
import numpy as np


def likeliest_supply(drives: Sequence[Drive], names: Sequence[str], start: Point, pool: Threads
                     ) -> Parameters:
    """
    Return nominal numbers, with a higher supply if the motors seem to get more.

    Parameters
    ----------
    drives : sequence of Drive
        Their commands say which voltage is asked for.
    names : sequence of str
        Of the recordings in the order of time.
    start : Point
        The nominal model.
    pool : Threads
        Threads to fit with.

    Returns
    -------
    numbers : Parameters
        The same object where no command asks for more than the supply, or none is likelier by
        more than the best of those that are tried would be by chance.

    """
    command, known = start.plant.sets[0].command, start.parameters
    if command.clamp <= 0.0:
        return known
    asked = max(float(np.max(np.abs(d.commands.values) @ np.array([
        command.volts_per_speed, command.volts_per_rate]))) for d in drives)
    gain = known.entry('command_gain')
    asked = min(asked, known.entry('supply_voltage').upper,
                command.clamp * gain.value / gain.lower)
    if asked <= command.clamp:
        return known
    evidence = evidence_of(drives, names, start, first_guess(drives, start.structure.robot), pool)
    count, rounds = int(setting('supplies')), int(setting('supply_rounds'))
    plain = evidence.fit(start, rounds=rounds).cost
    # What is never asked for cannot be told from any more.
    tried = [_supplied(known, float(most)) for most in np.linspace(
        command.clamp, asked, count + 1)[1:]]
    costs = [evidence.fit(beginning(
        start.structure, base_unknowns(numbers, drives), numbers, start.reading),
        rounds=rounds).cost for numbers in tried]
    best = int(np.argmin(costs))
    by_chance = math.log(count) - math.log(setting('false_alarm_rate'))
    return tried[best] if plain - costs[best] > by_chance else known


def _supplied(numbers: Parameters, supply: float) -> Parameters:
    share = numbers['supply_voltage'] / supply
    return numbers.replacing({'supply_voltage': supply,
                              'command_gain': share * numbers['command_gain']})
