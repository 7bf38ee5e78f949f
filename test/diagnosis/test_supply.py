# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Motors that get more voltage than the supply of the model, where commands ask for it."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from lg_husky_sim.diagnosis.diagnose import diagnose
from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.point import beginning, Point
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.result import Verdict
from lg_husky_sim.diagnosis.selection.supply import likeliest_supply
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.recording import Recording
from lg_husky_sim.threads import Threads
import pytest

#: Duration [s], forward [m/s], yaw [rad/s]: 27 V of the one side in fast turns.
FAST = ((1.0, 0.0, 0.0), (3.0, 0.9, 0.7), (2.0, 0.4, -0.9), (3.0, 0.9, -0.7), (2.0, -0.5, 0.4),
        (3.0, 0.85, 0.8), (2.0, 0.0, 1.2), (3.0, 0.95, -0.6), (1.0, 0.0, 0.0))
SLOW = tuple((duration, 0.6 * v, 0.6 * w) for duration, v, w in FAST)


@pytest.fixture
def pool() -> Iterator[Threads]:
    """Return one thread."""
    with Threads(1) as threads:
        yield threads


def supplied(volts: float) -> Plant:
    """Return the paper's robot with another pack, on which every command is the same voltage."""
    model = load_model()
    share = model.parameters['supply_voltage'] / volts
    return compile_model(model.structure).at(model.parameters.replacing({
        'supply_voltage': volts, 'command_gain': share * model.parameters['command_gain']}))


def start(recordings: list[Recording]) -> Point:
    """Return the nominal model as it begins."""
    model = load_model()
    return beginning(model.structure, base_unknowns(model.parameters, drives_of(recordings)),
                     model.parameters, Reading())


@pytest.mark.parametrize(('volts', 'steps', 'found'), [
    (24.0, FAST, 24.0), (100.0, FAST, 27.9), (26.0, FAST, 26.0), (100.0, SLOW, 24.0)])
def test_a_higher_supply_is_found_where_commands_ask_for_it(
        record: Callable[..., Recording], pool: Threads, volts: float,
        steps: tuple[tuple[float, float, float], ...], found: float) -> None:
    recordings = [record('rec1', supplied(volts), steps, 1)]
    nominal = start(recordings)
    numbers = likeliest_supply(drives_of(recordings), ['rec1'], nominal, pool)
    assert numbers['supply_voltage'] == pytest.approx(found, abs=0.6)
    assert numbers['supply_voltage'] * numbers['command_gain'] == pytest.approx(
        nominal.parameters['supply_voltage'] * nominal.parameters['command_gain'])
    assert (numbers is nominal.parameters) == (found == 24.0)


def test_a_robot_whose_motors_get_more_lacks_nothing(record: Callable[..., Recording]) -> None:
    """And a note says how much they get."""
    said = diagnose([record(name, supplied(100.0), FAST, seed) for seed, name in enumerate(
        ('rec1', 'rec2'))], load_model(), lambda text, share: None).diagnosis
    assert said.verdict is Verdict.NOTHING_MISSING
    assert any('the motors seem to get up to' in note for note in said.notes)
