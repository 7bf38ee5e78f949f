# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What is not in the catalogue is not given a name of it, and is modelled all the same."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
import re

from lg_husky_sim.diagnosis.candidates import effect_entries
from lg_husky_sim.diagnosis.diagnose import Case, diagnose
from lg_husky_sim.diagnosis.doubts import belief, is_guise
from lg_husky_sim.diagnosis.fits import Fit, fit_structure, recalibrate, shared_metric
from lg_husky_sim.diagnosis.judge import _acting_side
from lg_husky_sim.diagnosis.result import Estimate, Verdict
from lg_husky_sim.diagnosis.rivals import adopts, Rival
from lg_husky_sim.diagnosis.rounds import Round
from lg_husky_sim.diagnosis.search import Search
from lg_husky_sim.diagnosis.unnamed import Description, KNOTS, look_for_unnamed, Unnamed
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.identification.problem import observations
from lg_husky_sim.recording import Recording, segments
import numpy as np
import pytest

STEPS = ((1.0, 0.0, 0.0), (2.0, 0.8, 0.0), (2.0, 0.5, 0.8), (2.0, 0.0, 0.9), (2.0, -0.5, 0.5),
         (2.0, 0.8, -0.8), (2.0, 0.0, -0.9), (2.0, 0.4, -0.4), (2.0, 0.0, 0.0))
#: A force ahead that grows with the square of the yaw rate, as of a mass that sits in front.
RANGE = {'range_low': -1.0, 'range_high': 1.0}
AHEAD = {**RANGE, **{name: 40.0 * float(rate) ** 2
                     for name, rate in zip(KNOTS, np.linspace(-1.0, 1.0, 9), strict=True)}}
FORCE = Effect('smooth_force', shape='yaw')
Record = Callable[..., Recording]


def plant_with(effects: Mapping[Effect, Mapping[str, float]]) -> Plant:
    model = load_model()
    structure, parameters = model.structure, model.parameters
    for effect, values in effects.items():
        structure = structure.with_effect(effect)
        parameters = parameters.with_entries(*effect_entries(effect, values))
    return compile_model(structure).at(parameters)


def driven(record: Record, plant: Plant, name: str, seed: int) -> list[Recording]:
    return [record(f'{name}1', plant, STEPS, seed), record(f'{name}2', plant, STEPS[::-1],
                                                           seed + 1)]


def diagnosed(record: Record, effects: Mapping[Effect, Mapping[str, float]]) -> Case:
    return diagnose(driven(record, plant_with(effects), 'rec', 1), load_model(),
                    lambda text, share: None)


def test_effort_without_a_name_is_described_and_modelled(record: Record) -> None:
    found = diagnosed(record, {FORCE: AHEAD}).diagnosis
    assert found.verdict is Verdict.UNKNOWN
    (finding,) = found.findings
    assert (finding.effect, finding.subsystem) == ('unknown', 'translation')
    said = re.search(r'smooth function of yaw, between (\S+) and (\S+) N', finding.statement)
    assert said is not None
    assert float(said[1]) == pytest.approx(0.0, abs=2.0)
    assert 25.0 < float(said[2]) < 45.0
    assert [(e.id, e.shape) for e in found.model.structure.effects] == [('smooth_force', 'yaw')]
    for name in ('position_rmse_m', 'forward_rmse'):
        assert found.held_out_augmented[name] < 0.8 * found.held_out_plain[name], name


def test_change_without_a_name_is_described_from_then_on(record: Record) -> None:
    before, after = (driven(record, plant_with(effects), name, seed) for name, effects, seed in (
        ('base', {}, 1), ('rec', {FORCE: AHEAD}, 3)))
    found = diagnose(after, load_model(), lambda text, share: None, before).diagnosis
    assert found.verdict is Verdict.UNKNOWN
    assert found.confidence > 0.8
    (late,) = [e for e in found.model.structure.effects if e.id == 'smooth_force']
    assert (late.shape, late.late) == ('yaw', True)
    onset = found.model.structure.onset
    assert onset is not None
    assert (onset.recording, onset.earlier) == ('rec1', ('base1', 'base2'))
    assert found.augmented['position_rmse_m'] < 0.7 * found.plain['position_rmse_m']


def test_name_that_leaves_an_effort_elsewhere_is_a_guise(record: Record) -> None:
    """Scrub that grows with speed is in the catalogue; beside that force it is half the truth."""
    scrub = {Effect('yaw_scrub_speed'): {'scrub_slope': 6.0}}
    both = diagnosed(record, {**scrub, FORCE: AHEAD})
    assert [r.rivals[0].effect.id for r in both.search.rounds if r.adopted]
    assert both.diagnosis.verdict is Verdict.UNKNOWN
    assert both.diagnosis.model.about == both.diagnosis.findings[0].statement


def test_a_second_description_is_not_put_on_the_knots_of_the_first(record: Record) -> None:
    model = load_model()
    entries = effect_entries(FORCE, AHEAD)
    held = replace(model, structure=model.structure.with_effect(FORCE),
                   parameters=model.parameters.with_entries(*entries))
    data = observations(segments(record('ahead', plant_with({}), STEPS[:4], 1)))
    found = look_for_unnamed(data, recalibrate(data, held.structure, held.parameters))
    assert found.descriptions == ()
    assert found.share == 0.0


def test_smooth_effort_moves_the_recalibration_along(record: Record) -> None:
    """Its share is counted with the nominal numbers refitted: they had stood in for it."""
    model = load_model()
    data = observations(segments(record('ahead', plant_with({FORCE: AHEAD}), STEPS, 1)))
    found = look_for_unnamed(data, recalibrate(data, model.structure, model.parameters))
    assert found.descriptions[0].effect == FORCE
    assert found.share > 0.3
    shares = [found.share_of(d) for d in found.descriptions]
    assert min(shares) > -0.05


@pytest.fixture
def fitted(record: Record) -> Callable[[Effect], Fit]:
    """Return a function that puts an effect of its first size into a model."""
    def made(effect: Effect) -> Fit:
        model = load_model()
        data = observations(segments(record('rec', plant_with({}), STEPS[:3], 1)))
        base = recalibrate(data, model.structure, model.parameters)
        sizes = {p.name: p.starts[0] for p in effect.parameters()}
        fit = fit_structure(data, model.structure.with_effect(effect), model.parameters,
                            shared_metric(data, base, []), base.solution.values, sizes, 0)
        assert fit is not None
        return fit
    return made


def named(record: Record, *effects: Effect) -> Search:
    """Return a search that adopted one effect after the other, with 300 nats each."""
    model = load_model()
    data = observations(segments(record('rec', plant_with({}), STEPS, 1)))
    fit = recalibrate(data, model.structure, model.parameters)
    used = shared_metric(data, fit, [])
    rounds = tuple(Round(fit, (), (Rival(effect, None, fit, 300.0, 300.0),), used, 0.5, True)
                   for effect in effects)
    final = replace(fit, parameters=fit.parameters.with_entries(
        *(entry for effect in effects for entry in effect_entries(effect, {}))))
    return Search(data, fit, final, rounds, model.parameters)


@pytest.mark.parametrize(('part', 'efforts', 'guise'), [
    # Named: dry friction of an axle. Its own law may be bent, or lie elsewhere on the axle.
    ('drivetrain', {('smooth_torque', 'wheel_rate'): 5.0}, False),
    ('drivetrain', {('smooth_torque', 'wheel_rate'): 5.0, ('smooth_force', 'x'): 6.0}, False),
    ('drivetrain', {('smooth_torque', 'wheel_rate'): 5.0, ('smooth_force', 'x'): 7.0}, True),
    ('drivetrain', {('smooth_voltage', 'voltage'): 0.9}, False),
    ('drivetrain', {('smooth_voltage', 'time'): 1.1}, True),
    ('drivetrain', {('smooth_moment', 'yaw'): 0.3}, False),
    ('drivetrain', {('smooth_moment', 'yaw'): 0.5}, True),
    # A gyro that reads too little: no smooth effort is its own.
    ('sensor', {('smooth_moment', 'yaw'): 0.5}, True),
    ('sensor', {('smooth_moment', 'yaw'): 0.3}, False)])
def test_guise_leaves_much_beside_what_was_named(
        part: str, efforts: Mapping[tuple[str, str], float], guise: bool, record: Record,
        hidden: Mapping[str, tuple[Effect | None, dict[str, float]]]) -> None:
    effect = hidden[part][0]
    assert effect is not None
    search, gained = named(record, effect), 300.0
    left = tuple(sorted((Description(Effect(name, shape=shape, side='both' if name in (
        'smooth_torque', 'smooth_voltage') else 'none'), ratio * gained, 0.0, (0.0,) * 9,
        (0.0, 1.0), confirmed=0.2 * gained) for (name, shape), ratio in efforts.items()),
        key=lambda d: -d.held_out))
    unnamed = Unnamed(left, 1.0, 1, search.rounds[0].metric)
    assert is_guise(search, unnamed) is guise
    # What only a crowd of smooth efforts explains together says nothing.
    alone = tuple(replace(d, confirmed=15.0) for d in left)
    assert not is_guise(search, replace(unnamed, descriptions=alone))


@pytest.mark.parametrize(('gain', 'share', 'unstable', 'number', 'change', 'adopted'), [
    (300.0, 0.01, 0.1, 0, False, True), (300.0, 0.002, 0.1, 0, False, False),
    (300.0, 0.01, 0.4, 0, False, False), (300.0, 0.1, 0.1, 1, False, True),
    (300.0, 0.04, 0.1, 1, False, False), (1500.0, 0.04, 0.1, 1, False, True),
    (300.0, 0.04, 0.4, 0, True, True), (300.0, 0.1, 0.05, 1, True, True),
    (300.0, 0.2, 0.2, 1, True, False), (700.0, 0.05, 0.01, 1, True, True),
    (90.0, 0.6, 0.4, 1, True, True), (90.0, 0.3, 0.01, 1, True, False),
    (450.0, 0.25, 0.38, 1, True, True), (450.0, 0.25, 0.45, 1, True, False),
    (300.0, 0.6, 0.45, 1, False, True), (300.0, 0.4, 0.45, 1, False, False),
    (300.0, 0.6, 0.45, 0, False, False), (1500.0, 0.17, 0.4, 2, False, True),
    (1500.0, 0.17, 0.5, 2, False, False), (1500.0, 0.1, 0.4, 2, False, False)])
def test_effect_is_adopted_for_gain_share_and_steadiness(
        gain: float, share: float, unstable: float, number: int, change: bool, adopted: bool,
        fitted: Callable[[Effect], Fit]) -> None:
    fit = fitted(Effect('yaw_scrub_coulomb'))
    rival = Rival(fit.structure.effects[-1], None, fit, gain, gain)
    assert adopts(rival, share, unstable, 1.0, number, change) is adopted


@pytest.mark.parametrize(('effect', 'unstable', 'adopted'), [
    ('gear_backlash', 0.55, True), ('gear_backlash', 0.65, False),
    ('belt_compliance', 0.55, False), ('belt_compliance', 0.3, True)])
def test_play_may_help_in_some_stretches_only(
        effect: str, unstable: float, adopted: bool, fitted: Callable[[Effect], Fit]) -> None:
    """Where an idling gear lies in its play when a stretch begins is not seen."""
    fit = fitted(Effect(effect))
    rival = Rival(fit.structure.effects[-1], None, fit, 300.0, 300.0)
    assert adopts(rival, 0.3, unstable, 1.0, 0, False) is adopted


def test_a_name_is_believed_less_the_more_it_leaves() -> None:
    assert belief(5000.0, 0.9, 0.0) > 0.99
    # A tenth of the gain takes 0.3 away; its size, beyond chance, a share of another 0.3.
    assert belief(5000.0, 0.9, 500.0) == pytest.approx(0.7 * (1.0 - 0.3 * 440.0 / 840.0))
    assert belief(1e6, 0.9, 500.0) == pytest.approx(1.0 - 0.3 * 440.0 / 840.0, abs=0.01)
    assert belief(100.0, 0.1, 0.0) < 0.7


@pytest.mark.parametrize(('effect', 'moment', 'side'), [
    (Effect('yaw_pull'), 1.5, 'left'), (Effect('yaw_pull'), -1.5, 'right'),
    (Effect('slope'), 1.5, 'none'), (Effect('coulomb_drivetrain', 'right'), 1.5, 'right')])
def test_a_pull_says_to_which_side(effect: Effect, moment: float, side: str) -> None:
    number = Estimate('pull_moment', moment, 'N·m', moment - 0.1, moment + 0.1)
    assert _acting_side(effect, [number]) == side
