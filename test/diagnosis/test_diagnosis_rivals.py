# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Candidates of a round are compared at their best, and believed by all that speaks for them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from lg_husky_sim.diagnosis import rounds
from lg_husky_sim.diagnosis.candidates import Candidate, candidates, effect_entries
from lg_husky_sim.diagnosis.evidence import folds_of, held_out_cost, strain
from lg_husky_sim.diagnosis.fits import Fit, fit_structure, recalibrate, shared_metric
from lg_husky_sim.diagnosis.judge import is_unnamed
from lg_husky_sim.diagnosis.refits import between, refit
from lg_husky_sim.diagnosis.rivals import adopts, most_credible, rank, Rival
from lg_husky_sim.diagnosis.rounds import is_slight, left_by, play_round, Round, settled
from lg_husky_sim.diagnosis.screening import Score, Signature
from lg_husky_sim.diagnosis.search import Search
from lg_husky_sim.diagnosis.shortlist import always
from lg_husky_sim.diagnosis.unnamed import Description, Unnamed
from lg_husky_sim.diagnosis.workers import HERE
from lg_husky_sim.husky.effects import Effect, Onset, OnsetKind
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.identification.problem import Observations, observations
from lg_husky_sim.recording import Recording, segments
import numpy as np
import pytest

Record = Callable[..., Recording]
PAYLOAD = Effect('payload', shape='chassis')
LIMIT = Effect('command_limit', shape='both')
#: Limit [m/s] between two values of the catalogue, the upper of which no command reaches.
ENCLOSED = 0.84


def plant_with(effect: Effect, values: dict[str, float]) -> Plant:
    model = load_model()
    return compile_model(model.structure.with_effect(effect)).at(
        model.parameters.with_entries(*effect_entries(effect, values)))


@pytest.fixture(scope='module')
def data(record: Record, steps: Sequence[tuple[float, float, float]]) -> Observations:
    """Return two drives of a robot whose commands are limited."""
    plant = plant_with(LIMIT, {'limit_forward': 0.55, 'limit_yaw': 0.4})
    return observations([s for k, one in enumerate((steps, steps[::-1]))
                         for s in segments(record(f'rec{k}', plant, one, k))])


@pytest.fixture(scope='module')
def base(data: Observations) -> Fit:
    model = load_model()
    return recalibrate(data, model.structure, model.parameters)


def candidate(effect: Effect) -> Candidate:
    return next(c for c in candidates() if c.effect == effect)


def scored(effect: Effect, gain: float, onset: Onset | None = None, start: int = 0) -> Score:
    one = candidate(effect)
    sizes = one.starts[start]
    count = len(sizes) if one.signed else 1
    return Score(Signature(one, sizes, np.zeros((0, count)), one.signed), gain, (1.0,) * count,
                 onset)


def test_a_limit_above_all_commands_is_tried_lower(data: Observations, base: Fit) -> None:
    """The largest values of the catalogue limit nothing here, and have no slope to follow."""
    model, used = load_model(), shared_metric(data, base, [])
    fit = refit(data, base, model.parameters, scored(LIMIT, 1.0, start=4), used, 6)
    assert fit is not None
    assert fit.parameters['limit_forward'] == pytest.approx(0.55, abs=0.03)
    assert fit.parameters['limit_yaw'] == pytest.approx(0.4, abs=0.03)


@pytest.mark.parametrize('true', [1.02, 1.254, 1.45])
def test_a_limit_between_two_values_is_found(true: float) -> None:
    """The lower value does too much; the upper one does nothing, and has no slope."""
    def cost(sized: Mapping[str, float]) -> float:
        over = max(1.49 - sized['limit'], 0.0)
        return 4e4 * over * (over - 2.0 * (1.49 - true))
    least, sized = between(cost, {'limit': 1.0}, {'limit': 1.5})
    assert least < 0.0
    assert sized['limit'] == pytest.approx(true, abs=0.02)


def test_a_limit_that_the_catalogue_encloses_is_refitted(record: Record) -> None:
    model, effect = load_model(), Effect('command_limit', shape='forward')
    plant = plant_with(effect, {'limit_forward': ENCLOSED})
    drive = ((1.0, 0.0, 0.0), (3.0, 0.88, 0.0), (2.0, 0.4, 0.5), (3.0, -0.87, 0.0),
             (2.0, 0.0, -0.6), (3.0, 0.89, 0.3), (1.0, 0.0, 0.0))
    limited = observations(segments(record('rec', plant, drive, 1)))
    plain = recalibrate(limited, model.structure, model.parameters)
    used = shared_metric(limited, plain, [])
    starts = [start['limit_forward'] for start in candidate(effect).starts]
    harmful = starts.index(max(one for one in starts if one < ENCLOSED))
    found = refit(limited, plain, model.parameters, scored(effect, 300.0, start=harmful), used, 6)
    assert found is not None
    assert found.parameters['limit_forward'] == pytest.approx(ENCLOSED, abs=0.01)


def test_a_robot_at_its_nominal_numbers_is_not_strained(base: Fit) -> None:
    values = {u.name: u.value(u.centre) for u in base.solution.unknowns}
    calm = replace(base, solution=replace(base.solution, values=values))
    assert strain(calm) == 0.0
    heavier = {**values, 'mass': values['mass'] * np.exp(0.1)}
    off = replace(calm, solution=replace(base.solution, values=heavier))
    assert strain(off) == pytest.approx(0.5 * (0.1 / 0.05) ** 2)


@pytest.mark.parametrize(('gain', 'relief', 'number', 'change', 'unstable', 'adopted'), [
    (20.0, 10.0, 0, False, 0.1, True), (30.0, 3.0, 0, False, 0.1, False),
    (7.0, 10.0, 0, False, 0.1, False), (20.0, 10.0, 1, False, 0.1, False),
    (20.0, 10.0, 0, True, 0.1, False), (20.0, 10.0, 0, False, 0.4, False)])
def test_what_relieves_a_strained_recalibration_needs_less_gain(
        gain: float, relief: float, number: int, change: bool, unstable: float, adopted: bool,
        base: Fit) -> None:
    model = load_model()
    fit = replace(base, structure=base.structure.with_effect(PAYLOAD),
                  parameters=model.parameters.with_entries(*effect_entries(
                      PAYLOAD, {'payload_mass': 20.0, 'payload_inertia': 1.0})))
    rival = Rival(PAYLOAD, None, fit, gain, gain, relief)
    assert adopts(rival, 0.001, unstable, 1.0, number, change) is adopted


def test_a_heavy_load_strains_the_recalibration_of_a_light_robot(
        record: Record, steps: Sequence[tuple[float, float, float]]) -> None:
    model = load_model()
    plant = plant_with(PAYLOAD, {'payload_mass': 25.0, 'payload_inertia': 1.5})
    heavy = observations([s for k, one in enumerate((steps, steps[::-1]))
                          for s in segments(record(f'rec{k}', plant, one, k))])
    light = recalibrate(heavy, model.structure, model.parameters)
    one = play_round(heavy, light, 0, model.parameters, [candidate(PAYLOAD)], (),
                     folds_of(heavy))
    (best,) = one.rivals
    assert best.relief > 4.0
    assert 15.0 < best.fit.parameters['payload_mass'] < 35.0


@pytest.mark.parametrize(('effect', 'sizes', 'slight'), [
    (Effect('sensor_time_offset', shape='wheels'), {'stamp_delay': -0.005}, True),
    (Effect('sensor_time_offset', shape='wheels'), {'stamp_delay': -0.03}, False),
    (Effect('command_latency'), {'latency': 0.004}, True),
    (Effect('command_latency'), {'latency': 0.02}, False),
    (PAYLOAD, {'payload_mass': 0.1, 'payload_inertia': 0.0}, False)])
def test_stamps_that_are_off_by_less_than_jitter_are_no_physics(
        effect: Effect, sizes: dict[str, float], slight: bool, base: Fit) -> None:
    fit = replace(base, structure=base.structure.with_effect(effect),
                  parameters=base.parameters.with_entries(*effect_entries(effect, sizes)))
    assert is_slight(fit) is slight


def test_held_out_data_gain_no_more_than_is_credible() -> None:
    assert most_credible(100.0) == 220.0
    assert most_credible(-50.0) == 20.0


def test_all_are_at_their_best_under_the_metric_that_judges(
        data: Observations, base: Fit) -> None:
    """Rivals that were fitted under another metric differ by chance only afterwards."""
    model = load_model()
    used = shared_metric(data, base, [])
    flat = replace(used, filters={name: np.ones(1) for name in data.channels})
    score = scored(LIMIT, 1.0)
    fit = refit(data, base, model.parameters, score, flat, 6)
    assert fit is not None
    plain, ((_, best),) = settled(data, base, model.parameters, base, [(score, fit)], used, HERE)
    assert left_by(data, best, used) <= left_by(data, fit, used)
    assert left_by(data, plain, used) <= left_by(data, base, used)
    for one in (plain, best):
        again = fit_structure(data, one.structure, model.parameters, used, one.solution.values,
                              {**one.parameters}, 6)
        assert again is not None
        assert one.solution.cost - again.solution.cost < 0.5


def test_the_best_of_a_round_gains_what_it_explains(data: Observations, base: Fit) -> None:
    model, folds = load_model(), folds_of(data)
    one = play_round(data, base, 0, model.parameters, [candidate(LIMIT)], (), folds)
    (best,) = one.rivals
    assert one.adopted
    raw = float(np.sum(held_out_cost(data, one.base, one.metric, folds)
                       - held_out_cost(data, best.fit, one.metric, folds)))
    assert best.held_out == min(raw, most_credible(best.gain + max(best.relief, 0.0)))
    assert rank(best) == best.held_out + best.relief
    strained = replace(best, held_out=best.held_out + 0.3, relief=best.relief - 3.0)
    assert rank(strained) < rank(best)


def test_what_is_serious_late_is_tried_as_always_there() -> None:
    at = Onset(OnsetKind.TIME, 5.0, 'rec')
    late, early, weak = scored(LIMIT, 90.0, at), scored(LIMIT, 50.0), scored(LIMIT, 40.0)
    assert always([late], [late, early]) == [early]
    assert always([late], [late, weak]) == []
    assert always([late, early], [late, early]) == []


@pytest.mark.parametrize(('effect', 'gained', 'confirmed', 'unknown'), [
    ('smooth_force', 150.0, 0.0, True), ('smooth_force', 100.0, 0.0, False),
    ('smooth_moment', 250.0, 10.0, False), ('smooth_moment', 60.0, 30.0, True)])
def test_a_smooth_moment_must_be_confirmed(
        effect: str, gained: float, confirmed: float, unknown: bool, data: Observations,
        base: Fit) -> None:
    """On a rough floor a robot turns a little everywhere."""
    used = shared_metric(data, base, [])
    # At the noise, so that only the smooth effort speaks.
    calm = replace(base, solution=replace(base.solution, predicted=data.measured))
    search = Search(data, calm, calm, (Round(calm, (), (), used, 0.0, False),),
                    load_model().parameters)
    one = Description(Effect(effect, shape='yaw'), gained, 50.0, (0.0,) * 9, (0.0, 1.0),
                      confirmed=confirmed)
    assert is_unnamed(search, Unnamed((one,), 100.0, 1, used)) is unknown


@pytest.mark.parametrize(('number', 'steady', 'first'), [
    (1, 10.0, 'command_slew'), (1, 0.0, 'command_limit'), (0, 10.0, 'command_limit')])
def test_a_steady_further_effect_passes_one_that_is_refused(
        number: int, steady: float, first: str, data: Observations, base: Fit,
        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rounds, 'adopts', lambda best, *_: best.effect.id != LIMIT.id)
    monkeypatch.setattr(rounds, 'STEADY', steady)
    monkeypatch.setattr(rounds, 'BESIDE', -1e9)
    one = rounds.play_round(data, base, number, load_model().parameters,
                            [candidate(LIMIT), candidate(Effect('command_slew'))], (),
                            folds_of(data))
    assert one.rivals[0].effect.id == first
    assert one.adopted is (first != LIMIT.id)
    assert {r.effect.id for r in one.rivals} == {LIMIT.id, 'command_slew'}
