# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Every model composes: any two effects, sides, forms, onsets and orders."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from lg_husky_sim.husky.effects import catalogue, Effect, Onset, OnsetKind
from lg_husky_sim.husky.model import compile_model, Drivetrain, Structure
from lg_husky_sim.husky.model_file import (
    load_model,
    model_data,
    model_from_data,
    ModelFile,
    save_model,
)
from lg_husky_sim.linear_graph.drawing import draw_graph
from lg_husky_sim.signals import TimeSeries
from lg_husky_sim.simulation.events import Events, Propagator
from matplotlib.figure import Figure
import numpy as np
import pytest

EFFECTS = [Effect(name, side, shape) for name, kind in catalogue().items()
           for side in kind.sides for shape in kind.shapes]
"""The whole catalogue."""
PARTNERS = 2
"""Of each effect."""
ONSETS = (None, Onset(OnsetKind.TIME, 0.21), Onset(OnsetKind.PLACE_ABOVE, 0.03),
          Onset(OnsetKind.PLACE_BELOW, 0.05))
DRIVE = Events(TimeSeries(np.array([0.0, 0.13, 0.4]), np.array([[0.6, 0.3], [0.5, -0.4],
                                                                [-0.3, 0.1]]),
                          ('forward', 'yaw')), np.linspace(0.05, 0.6, 7))


def named(effect: Effect) -> str:
    return '-'.join(part for part in (effect.id, effect.side, effect.shape)
                    if part not in ('none', ''))


def model_of(pair: tuple[Effect, Effect], onset: Onset | None, late: tuple[bool, bool],
             drivetrain: Drivetrain) -> ModelFile:
    """Return a model of two effects; one that needs an onset begins at it whatever `late`."""
    effects = [replace(effect, late=not effect.always_on and (
        effect.kind.needs_onset or (onset is not None and begins)))
        for effect, begins in zip(pair, late, strict=True)]
    structure = Structure(drivetrain, onset=onset or (
        ONSETS[1] if any(effect.late for effect in effects) else None))
    for effect in effects:
        structure = structure.with_effect(effect)
    own = [p.parameter() for effect in effects for p in effect.parameters()]
    return ModelFile(structure, load_model().parameters.with_entries(*own), 'a pair')


def driven(model: ModelFile) -> np.typing.NDArray[np.float64]:
    propagator = Propagator(compile_model(model.structure).at(model.parameters))
    return propagator.run(DRIVE, propagator.initial())


def partners(first: int) -> list[int]:
    """Return other effects, drawn: all pairs together would take minutes."""
    others = np.delete(np.arange(len(EFFECTS)), first)
    chosen = np.random.default_rng(first).choice(others, PARTNERS, replace=False)
    return [int(other) for other in chosen]


@pytest.mark.parametrize('first', range(len(EFFECTS)), ids=lambda i: named(EFFECTS[i]))
def test_any_two_effects_are_written_and_read_to_the_same_bits(first: int, tmp_path: Path) -> None:
    """Orders, onsets and drivetrains take turns; the partners of an effect are drawn."""
    for second in partners(first):
        one, other = EFFECTS[first], EFFECTS[second]
        grip = 'grip' in (one.shape, other.shape)
        shared = {p.name for p in one.parameters()} & {p.name for p in other.parameters()}
        bare = grip and 'traction_saturation' not in (one.id, other.id)
        if one.id == other.id or shared or bare:
            continue  # one number cannot be two, and a limit can only change where there is one
        turn = first + second
        pair = (one, other) if turn % 2 else (other, one)
        late = (turn % 3 != 0, turn % 3 != 1)
        if grip:
            late = tuple(effect.shape == 'grip' for effect in pair)  # type: ignore[assignment]
        model = model_of(pair, ONSETS[turn // 2 % 4], late,
                         Drivetrain.EXPANDED if turn % 5 == 0 else Drivetrain.SIMPLIFIED)
        out = driven(model)
        assert np.all(np.isfinite(out)), (pair, model.structure)
        again = model_from_data(model_data(model), 'a pair')
        if turn % 7 == 0:
            save_model(model, tmp_path / 'model.yaml')
            again = load_model(tmp_path / 'model.yaml')
        assert again.structure == model.structure
        np.testing.assert_array_equal(driven(again), out, err_msg=str(pair))
        if turn % 9 == 0:
            draw_graph(Figure().add_axes((0.0, 0.0, 1.0, 1.0)), model.structure.network().graph)


def test_the_pairs_meet_every_onset_and_both_drivetrains() -> None:
    """The turns above leave nothing out."""
    turns = [first + second for first in range(len(EFFECTS)) for second in partners(first)]
    assert {turn // 2 % 4 for turn in turns} == {0, 1, 2, 3}
    assert {turn % 2 for turn in turns} == {0, 1}
    assert {turn % 3 for turn in turns} == {0, 1, 2}
    assert {turn % 5 == 0 for turn in turns} == {True, False}


@pytest.mark.parametrize('name', ['gear_backlash', 'coulomb_drivetrain', 'torque_ripple'])
def test_what_reads_an_axle_is_drawn_beside_a_belt(name: str) -> None:
    """The expanded graph's own axle is new beside the simplified one, and laws read its rate."""
    from lg_husky_sim.diagnosis.report_of_case import _graph_figure, new_elements

    plain, final = Structure(), Structure()
    for effect in (Effect(name), Effect('belt_compliance')):
        final = final.with_effect(effect)
    _, added = new_elements(plain, final)
    assert 'J_RL' in added
    assert _graph_figure(plain, final, ()) is not None
