# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Eq. (23) for many candidates: exact against expm, the simulator and plain arrays."""

from __future__ import annotations

from dataclasses import replace

from lg_husky_sim.errors import FitError
from lg_husky_sim.husky.effects import Effect, Onset, OnsetKind
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.model_file import ModelFile
from lg_husky_sim.identification import simd_batch
from lg_husky_sim.identification.modal_decoupling import can_decouple, ModalDecoupling
from lg_husky_sim.identification.options import with_effects
from lg_husky_sim.identification.paper_objective import PaperObjective, PERIOD, track_of
from lg_husky_sim.identification.problem import observations
from lg_husky_sim.jit import SWITCH
from lg_husky_sim.recording import Segment
import numpy as np
import pytest
from scipy.linalg import expm

FREE = ('wheel_damping', 'yaw_damping', 'command_gain')
DRAWS = np.random.default_rng(7).uniform([1.0, 1.0, 0.75], [100.0, 100.0, 1.0], (40, 3))


def maker(husky: ModelFile, free: tuple[str, ...] = FREE) -> ModalDecoupling:
    return ModalDecoupling(compile_model(husky.structure), husky.parameters, free)


def test_operators_equal_the_matrix_exponential(husky: ModelFile) -> None:
    modes = maker(husky)(DRAWS)
    found = simd_batch.operators(modes, PERIOD)
    for k in (0, 17, 39):
        for half in range(2):
            block = np.zeros((5, 5))
            block[:3, :3], block[:3, 4] = modes.a[k, half], modes.b[k, half]
            block[3, 1] = 1.0
            exact = expm(block * PERIOD)[:4][:, [0, 1, 2, 4]]
            np.testing.assert_allclose(found[half, :, :, k], exact, rtol=1e-9, atol=1e-11)


def test_halves_have_the_poles_of_the_graph(husky: ModelFile) -> None:
    model = compile_model(husky.structure)
    values = dict(zip(FREE, DRAWS[0], strict=True))
    whole = np.linalg.eigvals(model.at(husky.parameters.replacing(values)).sets[0].a)
    modes = maker(husky)(DRAWS[:1])
    split = np.concatenate([np.linalg.eigvals(modes.a[0, half]) for half in range(2)])
    np.testing.assert_allclose(np.sort(split.real), np.sort(whole.real), rtol=1e-9)


def test_dampings_are_learnt_as_affine_and_masses_are_not(husky: ModelFile) -> None:
    assert maker(husky).affine
    by_mass = maker(husky, ('mass', 'wheel_damping'))
    assert not by_mass.affine
    candidate = np.array([[60.0, 5.0]])
    exact = maker(ModelFile(husky.structure, husky.parameters.replacing(
        {'mass': 60.0, 'wheel_damping': 5.0})), FREE)(np.array([[5.0, 12.865, 0.8961]]))
    np.testing.assert_allclose(by_mass(candidate).a, exact.a, rtol=1e-12)


def test_batch_equals_the_simulator(husky: ModelFile, circle: Segment) -> None:
    model = compile_model(husky.structure)
    objective = PaperObjective(model, husky.parameters, FREE, [circle])
    assert objective.batched
    track = track_of(circle)
    assert track is not None
    costs = objective(DRAWS[:5])
    for row, cost in zip(DRAWS[:5], costs, strict=True):
        plant = model.at(husky.parameters.replacing(dict(zip(FREE, map(float, row),
                                                             strict=True))))
        alone = np.abs(track.simulate(plant) - track.targets).sum()
        assert cost == pytest.approx(alone, rel=1e-9)


def test_a_cost_does_not_depend_on_its_company(husky: ModelFile, circle: Segment) -> None:
    objective = PaperObjective(compile_model(husky.structure), husky.parameters, FREE,
                               [circle])
    together = objective(DRAWS)
    assert together[23] == objective(DRAWS[23:24])[0]
    assert together.shape == (40,)


def test_without_numba_the_numbers_are_the_same(husky: ModelFile, circle: Segment,
                                                monkeypatch: pytest.MonkeyPatch) -> None:
    objective = PaperObjective(compile_model(husky.structure), husky.parameters, FREE,
                               [circle])
    compiled = objective(DRAWS[:6])
    monkeypatch.setenv(SWITCH, '1')
    np.testing.assert_allclose(objective(DRAWS[:6]), compiled, rtol=1e-9)


def test_positions_between_steps_are_interpolated(husky: ModelFile, circle: Segment) -> None:
    pose = circle.streams['pose']
    late = replace(circle, streams={**circle.streams, 'pose': type(pose)(
        pose.times + 0.007, pose.values, pose.names).slice(0.0, circle.end)})
    track = track_of(late)
    assert track is not None
    np.testing.assert_allclose(track.times, late.streams['pose'].times, atol=1e-12)
    objective = PaperObjective(compile_model(husky.structure), husky.parameters, (), [late])
    plant = compile_model(husky.structure).at(husky.parameters)
    assert objective(np.zeros((1, 0)))[0] == pytest.approx(
        np.abs(track.simulate(plant) - track.targets).sum(), rel=1e-9)


def test_models_that_do_not_split_run_one_by_one(husky: ModelFile, circle: Segment) -> None:
    lopsided = with_effects(husky, ['viscous_asymmetry:left'])
    model = compile_model(lopsided.structure)
    assert not can_decouple(model, lopsided.parameters)
    assert not can_decouple(compile_model(Structure(effects=(Effect('command_latency'),))),
                            with_effects(husky, ['command_latency']).parameters)
    objective = PaperObjective(model, lopsided.parameters, FREE, [circle])
    assert not objective.batched
    assert np.all(np.isfinite(objective(DRAWS[:2])))
    assert objective(np.array([[-1.0, 1.0, 0.9]]))[0] == np.inf


def test_a_drive_without_pose_has_no_objective(husky: ModelFile, circle: Segment) -> None:
    blind = replace(circle, streams={k: v for k, v in circle.streams.items() if k != 'pose'})
    with pytest.raises(FitError, match='needs a pose'):
        PaperObjective(compile_model(husky.structure), husky.parameters, FREE, [blind])


def test_an_effect_begins_between_recordings(husky: ModelFile, circle: Segment) -> None:
    """However few of them are given, in the objective of the paper and in least squares."""
    effect = Effect('rolling_resistance', late=True)
    parameters = husky.parameters.with_entries(*(
        entry.parameter(60.0 if entry.name == 'rolling_force' else None)
        for entry in effect.parameters()))
    late = compile_model(Structure().with_effect(
        effect, Onset(OnsetKind.TIME, 5.0, 'two', ('one',)))).at(parameters)
    never, always = (compile_model(structure).at(parameters) for structure in (
        Structure(), Structure().with_effect(replace(effect, late=False))))
    for name, same, other in (('one', never, always), ('three', always, never)):
        part = replace(circle, recording=name)
        track, data = track_of(part), observations([part])
        assert track is not None
        for predict in (track.simulate, data.predict):
            np.testing.assert_array_equal(predict(late), predict(same))
            assert not np.allclose(predict(late), predict(other))
    # In its own recording from then on, and before it in what stands before it.
    parts = [replace(circle, recording=name) for name in ('zero', 'two')]
    tracks = PaperObjective(compile_model(husky.structure), husky.parameters, (), parts).tracks
    np.testing.assert_array_equal(tracks[0].simulate(late), tracks[0].simulate(never))
    own, early = tracks[1].simulate(late), tracks[1].times < 5.0
    np.testing.assert_allclose(own[early], tracks[1].simulate(never)[early], atol=1e-6)
    assert not np.allclose(own, tracks[1].simulate(never))
    assert not np.allclose(own, tracks[1].simulate(always))


def test_candidates_that_do_not_split_run_one_by_one(husky: ModelFile, circle: Segment) -> None:
    """Sides are equal where the search begins, and unequal wherever it looks."""
    objective = PaperObjective(compile_model(husky.structure), husky.parameters,
                               ('side_gain_ratio',), [circle])
    assert not objective.batched
    found = objective(np.array([[0.95], [1.0], [1.05]]))
    assert np.all(np.isfinite(found))
    assert len(set(found.tolist())) == 3
