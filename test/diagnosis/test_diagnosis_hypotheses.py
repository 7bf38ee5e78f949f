# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What may be missing, and when a gain is beyond chance."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import itertools

from lg_husky_sim.diagnosis.decision.adoption import (
    chance_of,
    is_beyond_chance,
)
from lg_husky_sim.diagnosis.evidence.dispersion import accident, dispersion
from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, evidence_of
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning, Point
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.hypotheses.hypothesis import hypotheses, Hypothesis, neutral_of
from lg_husky_sim.diagnosis.selection.tried import is_negligible, Tried
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.effects import catalogue, Effect, Onset, OnsetKind
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.threads import Threads
import numpy as np
import pytest

ALL = hypotheses(load_model().structure)
#: Those that do nothing at some allowed numbers, on a robot whose tyres have no limit to change.
NEUTRAL = [h for h in ALL if h.effect.shape != 'grip' and all(
    (at := neutral_of(p)) is not None and p.lower <= at <= p.upper for p in h.free)]


@pytest.fixture(scope='module')
def setup(drive: Callable[..., Recording]) -> Iterator[tuple[Evidence, Point]]:
    """Return the evidence of one drive and the nominal point."""
    drives, model = drives_of([drive('ahead', 'nothing', 1)]), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        yield evidence_of(drives, ['ahead'], start, first_guess(drives), pool), start


def test_larger_gains_are_less_likely_by_chance(setup: tuple[Evidence, Point]) -> None:
    chances = [chance_of(gain, ALL[0], 60, setup[0], 1.06) for gain in np.linspace(-5.0, 60.0, 40)]
    assert chances[0] == 1.0
    assert all(b <= a for a, b in itertools.pairwise(chances))
    assert not is_beyond_chance(chances[0])
    assert is_beyond_chance(chances[-1])


def test_more_tries_and_an_onset_make_a_gain_likelier_by_chance(
        setup: tuple[Evidence, Point]) -> None:
    evidence, one = setup[0], ALL[0]
    late = one.at(Onset(OnsetKind.TIME, 8.0, 'ahead'))
    few, many = (chance_of(15.0, one, tried, evidence, 1.06) for tried in (10, 100))
    assert few < many < chance_of(15.0, late, 100, evidence, 1.06) < 1.0
    assert many < chance_of(15.0, one, 100, evidence, 2.0)


def test_noise_that_is_correlated_makes_gains_larger_by_chance(
        setup: tuple[Evidence, Point]) -> None:
    evidence, rng = setup[0], np.random.default_rng(5)
    columns = np.cos(np.linspace(0.0, 40.0, evidence.count))[:, None]
    white = [dispersion(evidence, rng.standard_normal(evidence.count), columns)
             for _ in range(20)]
    slow = [dispersion(evidence, np.repeat(rng.standard_normal(
        evidence.count // 100 + 1), 100)[:evidence.count], columns) for _ in range(20)]
    assert np.mean(white) < 1.5
    assert np.mean(slow) > 5.0


def test_what_is_gained_within_one_stretch_is_an_accident(
        setup: tuple[Evidence, Point]) -> None:
    """A stretch that one innovation stands out of explains itself; a lasting effect does not."""
    evidence, nu = setup[0], setting('student')
    quiet = np.zeros(evidence.count)
    kicked, lasting = quiet.copy(), quiet.copy()
    kicked[evidence.count // 2:evidence.count // 2 + 10] = 4.0
    lasting[::evidence.count // 200] = 4.0

    def gained(innovations: FloatArray) -> float:
        return 0.5 * (nu + 1.0) * float(np.sum(np.log1p(innovations ** 2 / nu)))
    assert accident(evidence, kicked, quiet) == pytest.approx(gained(kicked))
    assert accident(evidence, lasting, quiet) < 0.5 * gained(lasting)
    assert accident(evidence, quiet, kicked) == 0.0


@pytest.mark.parametrize('taken', ['slope', 'gyro_scale', 'command_slew', 'coulomb_drivetrain'])
def test_an_effect_that_shares_a_number_with_one_that_is_there_is_not_offered(
        taken: str) -> None:
    own = next(h.effect for h in ALL if h.effect.id == taken)
    names = {p.name for p in own.parameters()}
    offered = hypotheses(load_model().structure.with_effect(own))
    assert offered
    for other in offered:
        assert not names & {p.name for p in other.effect.parameters()}, other.label
    clashing = {h.label for h in ALL if names & {p.name for p in h.effect.parameters()}}
    assert {h.label for h in ALL} - {h.label for h in offered} == clashing


def test_every_effect_of_the_catalogue_is_offered_to_a_plain_model() -> None:
    assert len({h.label for h in ALL}) == len(ALL)
    assert {'slope', 'gyro_scale', 'payload'} <= {h.effect.id for h in ALL}
    assert Effect('coulomb_drivetrain', 'left') in [h.effect for h in ALL]


def test_a_form_that_stands_for_others_is_offered_first() -> None:
    standing = [(kind.id, shape, other) for kind in catalogue().values()
                for shape, others in kind.stands_for.items() for other in others]
    assert standing
    for name, shape, other in standing:
        offered = [h for h in ALL if h.effect.id == name]
        assert other not in [h.effect.shape for h in offered]
        for own in (h for h in offered if h.effect.shape == shape):
            (later,) = [h for h in own.others if h.effect.shape == other]
            assert later.effect == Effect(name, own.effect.side, other)
            assert {p.name for p in later.free} <= {p.name for p in own.free}
            assert set(later.starts[0]) == {p.name for p in later.free}
            assert own.effect in [h.effect for h in later.others]
            assert own.family == later.family


def small(hypothesis: Hypothesis) -> dict[str, float]:
    """Return numbers that do nothing; next to nothing where the scale is logarithmic."""
    found = {}
    for p in hypothesis.free:
        neutral = neutral_of(p)
        assert neutral is not None
        found[p.name] = neutral if neutral != 0.0 or p.lower < 0.0 else 1e-4 * p.starts[0]
    return found


@pytest.mark.parametrize('hypothesis', NEUTRAL, ids=lambda h: str(h.label))
def test_an_effect_at_its_neutral_numbers_predicts_what_the_base_predicts(
        hypothesis: Hypothesis, setup: tuple[Evidence, Point]) -> None:
    evidence, base = setup
    point = hypothesis.point(base, small(hypothesis))
    plain, other = evidence.predict(base)[0], evidence.predict(point)[0]
    # The loosest limit of acceleration that the catalogue allows rounds a step by a little.
    part = 0.004 if hypothesis.effect.id == 'command_slew' else 0.001
    off = float(np.sqrt(np.mean((plain - other) ** 2)))
    assert off < part * float(np.std(evidence.drives[0].measured))


@pytest.mark.parametrize(('name', 'shape', 'jitter'), [
    ('command_latency', '', 'command_jitter'), ('sensor_time_offset', 'wheels', 'wheel_jitter'),
    ('sensor_time_offset', 'imu', 'imu_jitter'), ('sensor_time_offset', 'pose', 'pose_jitter')])
def test_a_delay_that_jitter_brings_is_not_called_missing(
        setup: tuple[Evidence, Point], name: str, shape: str, jitter: str) -> None:
    """A base that looks for commands every 20 ms is 10 ms late, and 6 ms more or less."""
    evidence, start = setup
    one = next(h for h in ALL if h.effect.id == name and h.effect.shape == shape)
    (parameter,) = one.free
    point = one.point(start, {parameter.name: 0.009})
    fit = evidence.fit(point, rounds=0)
    quiet = dict.fromkeys(evidence.noise.values, 1e-4)
    tried = Tried(one, fit, 50.0, evidence.count)
    assert not is_negligible(tried, quiet)
    assert is_negligible(tried, {**quiet, jitter: 0.02 / 12 ** 0.5})


@pytest.mark.parametrize(('forward', 'yaw', 'nothing'), [
    (12.0, 25.0, False), (3.0, 90.0, False), (35.0, 6.0, False), (35.0, 90.0, True)])
def test_a_limit_of_acceleration_that_no_base_has_is_none(
        setup: tuple[Evidence, Point], forward: float, yaw: float, nothing: bool) -> None:
    evidence, start = setup
    one = next(h for h in ALL if h.effect.id == 'command_slew' and h.effect.shape == 'both')
    fit = evidence.fit(one.point(start, {'slew_forward': forward, 'slew_yaw': yaw}), rounds=0)
    assert is_negligible(Tried(one, fit, 50.0, evidence.count), evidence.noise.values) is nothing


@pytest.mark.parametrize(('stiffness', 'hold', 'nothing'), [
    (20.0, 2.0, False), (1500.0, 2.0, False), (20.0, 50.0, False), (1500.0, 50.0, True)])
def test_a_belt_that_is_stiff_and_holds_is_none(
        setup: tuple[Evidence, Point], stiffness: float, hold: float, nothing: bool) -> None:
    evidence, start = setup
    one = next(h for h in ALL if h.effect.id == 'belt_compliance' and h.effect.shape == 'slipping')
    fit = evidence.fit(one.point(start, {
        'belt_stiffness': stiffness, 'belt_damping': 0.3, 'belt_hold': hold}), rounds=0)
    assert is_negligible(Tried(one, fit, 50.0, evidence.count), evidence.noise.values) is nothing


@pytest.mark.parametrize(('play', 'nothing'), [(0.02, False), (0.004, True)])
def test_gears_without_play_are_none_whatever_turns_with_the_motor(
        setup: tuple[Evidence, Point], play: float, nothing: bool) -> None:
    evidence, start = setup
    one = next(h for h in ALL if h.effect.id == 'gear_backlash')
    fit = evidence.fit(one.point(start, {'play': play, 'rotor_share': 0.9}), rounds=0)
    assert is_negligible(Tried(one, fit, 50.0, evidence.count), evidence.noise.values) is nothing
