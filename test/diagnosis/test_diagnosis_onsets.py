# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A place that matters only after a change: onsets to try, and the model with one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from lg_husky_sim.diagnosis import onset_placing
from lg_husky_sim.diagnosis.candidates import effect_entries
from lg_husky_sim.diagnosis.fits import first_metric, Fit, fit_structure
from lg_husky_sim.diagnosis.onset_placing import begun_late, refined_onsets
from lg_husky_sim.diagnosis.onsets import change_onsets
from lg_husky_sim.diagnosis.screening import Projector
from lg_husky_sim.husky.effects import Effect, Onset, OnsetKind
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.identification.noise import Metric
from lg_husky_sim.identification.problem import Observations, observations
from lg_husky_sim.recording import Recording, segments
import numpy as np
import pytest

SLOPE = {'slope_x': 40.0, 'slope_y': 10.0}


@pytest.fixture(scope='module')
def data(drive: Callable[..., Recording]) -> Observations:
    """Return two recordings before a change and two after it."""
    made = [drive(f'{when}{i}', 'nothing', 2 * i + j, backwards=bool(i))
            for j, when in enumerate(('before', 'after')) for i in (0, 1)]
    return observations([s for one in made for s in segments(one)])


def change(data: Observations) -> Onset:
    """Return the beginning of the later recordings."""
    return Onset(OnsetKind.TIME, data.pieces[2].start, 'after0')


def owners(data: Observations) -> np.ndarray:
    """Return the number of each value's recording."""
    owner = np.zeros(data.measured.size, dtype=int)
    for one in data.slices:
        owner[one.first:one.last] = data.recordings.index(data.pieces[one.piece].recording)
    return owner


def test_places_are_tried_in_later_recordings_only(data: Observations) -> None:
    given, times, places = change_onsets(data, change(data))
    assert given.given
    assert not times.given
    assert not places.given
    assert {o.kind for o, _ in places.onsets} == {OnsetKind.PLACE_ABOVE, OnsetKind.PLACE_BELOW}
    owner = owners(data)
    for onset, groups in places.onsets:
        assert onset.recording == 'after0'
        on = groups[places.groups]
        assert not np.any(on & (owner < 2))
        assert np.any(on)
    above, below = (next(g for o, g in places.onsets if o.kind is kind) for kind in (
        OnsetKind.PLACE_ABOVE, OnsetKind.PLACE_BELOW))
    assert not np.any(above & below)
    assert len(places.placebos) == 2


def test_a_further_effect_begins_at_the_place_that_was_found(data: Observations) -> None:
    found = Onset(OnsetKind.PLACE_BELOW, 0.7, 'after0')
    (only,) = change_onsets(data, change(data), found)
    assert only.given
    assert [o for o, _ in only.onsets] == [found]
    on = only.onsets[0][1][only.groups]
    assert np.any(on)
    assert not np.any(on & (owners(data) < 2))


def sloped(value: float) -> tuple[Fit, Onset]:
    """Return an unfitted model with a slope beyond a place, after the change."""
    model = load_model()
    onset = Onset(OnsetKind.PLACE_ABOVE, value, 'after0')
    effect = Effect('slope', late=True)
    structure = model.structure.with_effect(effect, onset)
    return Fit(structure, model.parameters.with_entries(*effect_entries(effect, SLOPE)),
               None), onset  # type: ignore[arg-type]


def test_a_place_changes_nothing_before_the_change_and_less_than_all_after_it(
        data: Observations) -> None:
    model = load_model()
    plain = data.predict(compile_model(model.structure).at(model.parameters))
    fit, onset = sloped(0.5)
    plant = compile_model(fit.structure).at(fit.parameters)
    here = data.predict(plant)
    everywhere = data.predict(compile_model(replace(
        fit.structure, onset=replace(onset, value=-50.0))).at(fit.parameters))
    owner = owners(data)
    assert np.array_equal(here[owner < 2], plain[owner < 2])
    for late in (2, 3):
        assert np.max(np.abs((here - plain)[owner == late])) > 0.01
        assert np.max(np.abs((here - everywhere)[owner == late])) > 0.01
    # Outside the recordings that are known: wherever the place is passed.
    assert plant.in_recording('another') is plant
    assert len(plant.in_recording('before0', ('before0',)).sets) == 1


def measured_as(data: Observations, seen: np.ndarray) -> Observations:
    """Return data whose values are others."""
    return Observations(tuple(
        replace(piece, channels=tuple(
            replace(c, values=seen[s.first:s.last]) for c, s in zip(
                piece.channels, [s for s in data.slices if s.piece == k], strict=True)))
        for k, piece in enumerate(data.pieces)))


def test_the_place_is_found_finely(data: Observations) -> None:
    fit, onset = sloped(1.0)
    seen = data.predict(compile_model(fit.structure).at(fit.parameters))
    exact = measured_as(data, seen)
    start = replace(fit.structure, onset=replace(onset, value=1.3))
    values = {name: fit.parameters[name] for name in fit.parameters}
    metric = first_metric(exact, seen)
    begun = fit_structure(exact, start, fit.parameters, metric, values, values, 0, polish=False)
    assert begun is not None
    better, *_ = refined_onsets(exact, begun, metric, change(exact))
    assert better.kind is OnsetKind.PLACE_ABOVE
    assert better.recording == 'after0'
    assert better.value == pytest.approx(1.0, abs=0.1)


def test_a_valley_between_coarse_onsets_is_looked_into(
        data: Observations, monkeypatch: pytest.MonkeyPatch) -> None:
    """A wide valley at 9 s is found coarsely, a deeper and narrow one at 4.2 s only inside."""
    fit, place = sloped(0.0)
    onset = Onset(OnsetKind.TIME, 9.0, place.recording)
    fit = replace(fit, structure=replace(fit.structure, onset=onset))

    def cost(*given: object) -> float:
        at = given[-1]
        assert isinstance(at, Onset)
        if at.recording != place.recording:
            return 2000.0
        wide, narrow = 100.0 + 400.0 * abs(at.value - 9.0), 1000.0 * abs(at.value - 4.2)
        return min(wide, narrow, 500.0 + abs(at.value - 4.2))
    monkeypatch.setattr(onset_placing, '_cost', cost)
    metric = first_metric(data, data.measured)
    first, second = refined_onsets(data, fit, metric, change(data))
    assert first.value == pytest.approx(4.2, abs=0.06)
    assert second.value == pytest.approx(9.0, abs=0.06)
    assert {first.recording, second.recording} == {place.recording}


@pytest.mark.parametrize('begins', [None, 6.0])
def test_a_change_that_begins_inside_a_recording_is_seen(data: Observations,
                                                         begins: float | None) -> None:
    """However much it gains altogether, it is not put where it harms."""
    given = change(data)
    true = given if begins is None else replace(given, value=begins)
    fit, _ = sloped(0.0)
    structure = replace(fit.structure, onset=true)
    noise = 0.01 * np.random.default_rng(3).standard_normal(data.measured.size)
    exact = measured_as(data, noise + data.predict(
        compile_model(structure).at(fit.parameters)))
    values = {name: fit.parameters[name] for name in fit.parameters}
    metric = Metric(np.full(noise.size, 100.0), {name: np.ones(1) for name in data.channels})
    held = fit.parameters.with_entries(*(
        replace(p, tolerance=0.0) for p in fit.parameters.entries))
    early = fit_structure(exact, replace(structure, onset=given), held, metric, values, values, 6)
    assert early is not None
    found = begun_late(exact, early, held, metric, given).structure.onset
    assert found is not None
    if begins is None:
        assert found == given
    else:
        assert found.recording == 'after0'
        assert found.value == pytest.approx(begins, abs=1.0)


def test_a_change_is_no_model_error_mirrored(data: Observations) -> None:
    # What is on after the change explains, turned round, much of it in one recording before.
    draws = np.random.default_rng(1)
    size = data.measured.size
    owner = owners(data)
    column = draws.standard_normal((size, 1))
    everywhere = np.hstack([column, draws.standard_normal((size, 2))])
    residual = np.where(owner >= 2, 0.5, 0.0) * column[:, 0] + 0.5 * draws.standard_normal(size)
    metric = Metric(np.ones(size), {name: np.ones(1) for name in data.channels})
    projector = Projector(data, metric, residual, everywhere, np.full(3, np.inf), np.zeros(3))
    given = change_onsets(data, change(data))[0]
    (sums,) = projector.all_sums(metric.filtered(data, column), [slice(0, 1)], given.groups,
                                 given.count)
    after = given.onsets[0][1]
    gain = sums.gain(after, True)[0]
    alone = max(sums.gain(other, True)[0] for other in given.placebos)
    beside = np.max(sums.beside(after, np.array(given.placebos), True))
    assert alone > 0.2 * gain
    assert beside < 0.01 * gain
