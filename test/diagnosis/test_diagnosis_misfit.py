# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""How far a model stays from the data says that something is missing, or that a name is not it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
import math

from lg_husky_sim.diagnosis.candidates import effect_entries
from lg_husky_sim.diagnosis.diagnose import _notes
from lg_husky_sim.diagnosis.doubts import belief, is_guise, reading_gain
from lg_husky_sim.diagnosis.fits import Fit, fit_structure, recalibrate, shared_metric
from lg_husky_sim.diagnosis.judge import confidence, is_unnamed
from lg_husky_sim.diagnosis.misfit import (
    against_before,
    beyond_chance,
    is_far,
    mean_squares,
    ratios,
    trust,
)
from lg_husky_sim.diagnosis.nameless import description_words, unnamed_finding
from lg_husky_sim.diagnosis.result import Verdict
from lg_husky_sim.diagnosis.rivals import Rival
from lg_husky_sim.diagnosis.rounds import Round
from lg_husky_sim.diagnosis.search import Search
from lg_husky_sim.diagnosis.unnamed import Description, Unnamed
from lg_husky_sim.husky.effects import Effect, Onset, OnsetKind
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.identification.problem import Observations, observations
from lg_husky_sim.recording import Recording, segments
from lg_husky_sim.signals import FloatArray
import numpy as np
import pytest

Drive = Callable[..., Recording]
SCALE = Effect('gyro_scale')


@pytest.fixture(scope='module')
def data(drive: Drive) -> Observations:
    parts = [*segments(drive('before', 'nothing', 1)), *segments(drive('after', 'nothing', 2))]
    return observations(parts)


@pytest.fixture(scope='module')
def plain(data: Observations) -> Fit:
    model = load_model()
    return recalibrate(data, model.structure, model.parameters)


def searched(data: Observations, plain: Fit, final: Fit, change: bool = False,
             adopted: bool = False) -> Search:
    used = shared_metric(data, plain, [])
    if adopted:
        final = replace(final, parameters=final.parameters.with_entries(
            *effect_entries(SCALE, {})))
    rivals = (Rival(SCALE, None, final, 900.0, 900.0),) if adopted else ()
    onset = Onset(OnsetKind.TIME, 0.0, 'after') if change else None
    return Search(data, plain, final, (Round(plain, (), rivals, used, 0.9, adopted),),
                  load_model().parameters, onset)


def off(data: Observations, fit: Fit, channel: str, sizes: float, recordings: Sequence[str]
        ) -> Fit:
    """Return a fit that misses a channel by so many noise levels, up and down each second."""
    predicted = fit.solution.predicted.copy()
    scale = shared_metric(data, fit, []).scale
    for one in data.slices:
        if one.channel == channel and data.pieces[one.piece].recording in recordings:
            part = slice(one.first, one.last)
            sign = np.where(data.times[part] % 2.0 < 1.0, 1.0, -1.0)
            predicted[part] += np.where(scale[part] > 0.0, sign * sizes / np.where(
                scale[part] > 0.0, scale[part], 1.0), 0.0)
    return replace(fit, solution=replace(fit.solution, predicted=predicted))


def test_a_right_model_is_at_the_noise(data: Observations, plain: Fit) -> None:
    squares = mean_squares(data, plain, shared_metric(data, plain, []))
    assert set(squares) == set(data.channels)
    assert all(0.2 < square < 2.0 for square in squares.values())
    assert not is_far(searched(data, plain, plain))


@pytest.mark.parametrize(('channel', 'sizes', 'far'), [
    ('yaw_rate', 2.0, False), ('yaw_rate', 5.0, True), ('wheel_left', 1.5, False),
    ('wheel_left', 3.0, True), ('advance', 0.5, False), ('advance', 2.5, True)])
def test_nothing_missing_is_no_answer_far_from_the_noise(
        channel: str, sizes: float, far: bool, data: Observations, plain: Fit) -> None:
    search = searched(data, plain, off(data, plain, channel, sizes, data.recordings))
    assert is_far(search) is far
    assert is_unnamed(search, None) is far
    if far:
        assert confidence(search, Verdict.UNKNOWN) == pytest.approx(0.9)


@pytest.mark.parametrize(('recordings', 'far'), [
    (('after',), True), (('before', 'after'), False), (('before',), False)])
def test_a_change_is_measured_by_what_was_left_before(
        recordings: Sequence[str], far: bool, data: Observations, plain: Fit) -> None:
    """Two noise levels in both are a poor model of the robot, and no change."""
    worse = off(data, plain, 'wheel_right', 2.0, recordings)
    search = searched(data, plain, worse, change=True)
    assert is_far(search) is far
    assert (against_before(search, worse, False) > 3.0) is far
    assert (trust(search) < 0.95) is far


@pytest.mark.parametrize(('sizes', 'said'), [(0.0, False), (3.0, True)])
def test_a_note_says_that_a_change_is_only_near(
        sizes: float, said: bool, data: Observations, plain: Fit) -> None:
    final = off(data, plain, 'yaw_rate', sizes, ('after',))
    search = searched(data, plain, final, change=True, adopted=True)
    for verdict in (Verdict.KNOWN, Verdict.UNKNOWN):
        notes = _notes(search, verdict)
        assert any('times as far from the model as the earlier ones' in n for n in notes) is (
            said and verdict is Verdict.KNOWN)


def test_nothing_in_common_before_and_after_is_not_far(data: Observations, plain: Fit) -> None:
    """The gyro was there before a change only, everything else after it only."""
    slices = tuple(s for s in data.slices if (s.channel == 'yaw_rate') is (
        data.pieces[s.piece].recording == 'before'))
    apart = replace(data)
    apart.__dict__['slices'] = slices
    search = searched(data, plain, plain, change=True)
    search = replace(search, observations=apart)
    assert ratios(search, plain, False) == {}
    assert not is_far(search)
    assert trust(search) == 1.0


def test_a_name_that_leaves_much_is_believed_less(data: Observations, plain: Fit) -> None:
    worst, bad = (off(data, plain, 'yaw_rate', sizes, data.recordings) for sizes in (9.0, 4.0))
    explained = trust(searched(data, worst, plain, adopted=True))
    half = trust(searched(data, worst, bad, adopted=True))
    hardly = trust(searched(data, bad, bad, adopted=True))
    assert 1.0 >= explained > 0.95 > half > hardly > 0.5


def clipped(recording: Recording, rate: float) -> Recording:
    imu = recording.stream('imu')
    values: FloatArray = imu.values.copy()
    values[:, 0] = np.clip(values[:, 0], -rate, rate)
    streams = {**recording.streams, 'imu': replace(imu, values=values)}
    return replace(recording, streams=streams)


def test_a_clipping_gyro_is_seen_behind_one_that_reads_too_little(drive: Drive) -> None:
    """Its name leaves an error that is a function of the reading, and lasts as long as it does."""
    model = load_model()
    gains = {}
    for name, recordings in (
            ('scaled', [drive('ahead', 'sensor', 1), drive('back', 'sensor', 2, True)]),
            ('clipped', [clipped(drive('ahead', 'nothing', 1), 0.6),
                         clipped(drive('back', 'nothing', 2, True), 0.6)])):
        own = observations([s for r in recordings for s in segments(r)])
        base = recalibrate(own, model.structure, model.parameters)
        fit = fit_structure(own, model.structure.with_effect(SCALE), model.parameters,
                            shared_metric(own, base, []), base.solution.values,
                            {'gyro_factor': 0.9}, 12)
        assert fit is not None
        assert fit.parameters['gyro_factor'] < 0.97
        gains[name] = reading_gain(own, fit)
    assert gains['scaled'] < 40.0
    assert gains['clipped'] > 100.0
    assert belief(1000.0, 0.9, gains['clipped']) < 0.8 < 0.99 < belief(
        1000.0, 0.9, 0.1 * gains['scaled'])


def smooth(search: Search, gained: float) -> Unnamed:
    """Return a smooth effort that gained so much, and half of what was unexplained."""
    one = Description(Effect('smooth_force', shape='yaw'), gained, 50.0, (0.0,) * 9, (0.0, 1.0))
    return Unnamed((one,), 100.0, 1, search.rounds[0].metric)


@pytest.mark.parametrize(('sizes', 'gained', 'unknown'), [
    (0.0, 4600.0, False), (1.1, 900.0, False), (1.1, 4600.0, True)])
def test_a_smooth_change_must_also_be_farther_than_before(
        sizes: float, gained: float, unknown: bool, data: Observations, plain: Fit) -> None:
    """A clean robot had 4601 nats, and was as close to its model after as before."""
    final = off(data, plain, 'yaw_rate', sizes, ('after',))
    search = searched(data, plain, final, change=True)
    assert not is_far(search)
    assert is_unnamed(search, smooth(search, gained)) is unknown


@pytest.mark.parametrize(('shares', 'sizes', 'guise'), [
    ((0.06,), 4.0, True), ((0.06,), 0.0, False), ((0.2,), 4.0, False),
    ((0.06, 0.06), 4.0, False)])
def test_a_name_for_hardly_anything_is_none_where_the_model_is_far(
        shares: Sequence[float], sizes: float, guise: bool, data: Observations, plain: Fit
        ) -> None:
    final = off(data, plain, 'wheel_left', sizes, data.recordings)
    search = searched(data, plain, final, adopted=True)
    search = replace(search, rounds=tuple(replace(search.rounds[0], share=s) for s in shares))
    assert is_guise(search, Unnamed((), 100.0, 1, search.rounds[0].metric)) is guise


@pytest.mark.parametrize(('ratio', 'limit'), [(2.0, 2.78), (1.6, 2.07)])
def test_short_recordings_differ_by_chance(
        ratio: float, limit: float, data: Observations, plain: Fit) -> None:
    """Of nineteen seconds each; a minute and more is held to the ratio itself."""
    change = searched(data, plain, plain, change=True)
    assert beyond_chance(change, ratio) == pytest.approx(limit, abs=0.02)
    longer = replace(data, pieces=tuple(replace(p, count=6100) for p in data.pieces))
    assert beyond_chance(replace(change, observations=longer), ratio) == ratio


@pytest.mark.parametrize(('shape', 'words'), [
    ('angle_right', "a smooth function of the right wheel's angle"),
    ('yaw', 'a smooth function of yaw')])
def test_a_description_says_what_it_depends_on(shape: str, words: str) -> None:
    moment = Description(Effect('smooth_moment', shape=shape), 1.0, 1.0, (0.0,) * 9, (0.0, 1.0))
    assert words in description_words(moment)


def test_unknown_by_distance_alone_names_the_channel(data: Observations, plain: Fit) -> None:
    """Nothing was screened, nothing refitted and no smooth effort helps."""
    search = searched(data, plain, off(data, plain, 'advance', 2.5, data.recordings))
    finding, description = unnamed_finding(search, Unnamed((), 1.0, 1, search.rounds[0].metric))
    assert (finding.effect, finding.subsystem, description) == ('unknown', 'translation', None)
    assert 'The advance is far from the model' in finding.statement
    assert math.isnan(finding.p_value)
    assert finding.chance == ''
    assert replace(finding, p_value=0.003).chance == 'p = 0.003'
    assert replace(finding, p_value=0.0).chance == 'p < 1e-99'
