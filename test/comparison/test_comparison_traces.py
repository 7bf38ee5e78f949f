# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings and their predictions as the traces and tables of a report."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.comparison import channel_errors, replay, tracking
from lg_husky_sim.comparison.models import NamedPlant
from lg_husky_sim.comparison.rival import rival_prediction
from lg_husky_sim.comparison.traces import change_intervals, error_table, traces_of
from lg_husky_sim.recording import Recording, Segment, segments, windows
from lg_husky_sim.reporting.data import Headline, ReportData
from lg_husky_sim.reporting.pictures import path_picture
from lg_husky_sim.signals import TimeSeries
import numpy as np
import pytest


def _changed(segment: Segment, series: TimeSeries, name: str, by: float) -> TimeSeries:
    moved = np.array(series.values)
    moved[1:, series.names.index(name)] += by
    return TimeSeries(series.times, moved, series.names)


def test_traces_are_what_was_measured_and_predicted(
        paper: NamedPlant, drive: Callable[[str], Recording]) -> None:
    (segment,) = segments(drive('circle'))
    prediction = replay(paper.plant, segment)
    found = {one.channel: one for one in traces_of(
        [(segment, {'paper': prediction, 'off': _changed(segment, prediction, 'yaw_rate', 0.1)})],
        ('paper', 'off'))}
    assert list(found) == ['wheel_left', 'wheel_right', 'forward', 'yaw_rate', 'x', 'y']
    np.testing.assert_array_equal(found['wheel_left'].measured,
                                  segment.streams['wheels'].column('left'))
    yaw = found['yaw_rate']
    error = yaw.measured - yaw.predicted['off']  # measured minus predicted
    assert np.nanmedian(error) == pytest.approx(-0.1, abs=0.01)
    track = tracking(segment, prediction)
    np.testing.assert_allclose(
        np.column_stack([found['x'].measured, found['y'].measured]), track.measured, atol=1e-9)


def test_between_segments_no_line_is_drawn(
        paper: NamedPlant, drive: Callable[[str], Recording]) -> None:
    parts = windows(segments(drive('circle'))[0], 9.0)
    assert len(parts) > 1
    (trace,) = (one for one in traces_of(
        [(part, {'paper': replay(paper.plant, part)}) for part in parts], ('paper',))
        if one.channel == 'wheel_left')
    assert np.isnan(trace.measured).sum() == len(parts) - 1
    assert np.all(np.diff(trace.times) >= 0.0)


@pytest.mark.parametrize('horizon', [0.05, 0.5])
def test_segments_too_short_for_a_slope_have_no_trace_of_it(
        paper: NamedPlant, drive: Callable[[str], Recording], horizon: float) -> None:
    parts = windows(segments(drive('circle'))[0], horizon)[:20]
    found = traces_of([(part, {'paper': replay(paper.plant, part)}) for part in parts],
                      ('paper',))
    channels = {one.channel for one in found}
    assert {'wheel_left', 'yaw_rate', 'x', 'y'} <= channels
    # A slope over half a second needs as long a segment; on the edge, rounding says.
    assert horizon == 0.5 or 'forward' not in channels
    assert all(np.isfinite(one.measured).any() for one in found)


def test_the_tracking_errors_of_a_picture_are_those_of_the_table(
        paper: NamedPlant, drive: Callable[[str], Recording]) -> None:
    parts = [(part, {'off': _changed(part, replay(paper.plant, part), 'y', 0.1 + 0.1 * place)})
             for place, part in enumerate(windows(segments(drive('circle'))[0], 9.0))]
    assert len(parts) > 1
    rows = {row.name: row.values['off'] for row in error_table('', parts, ('off',)).rows}
    traces = {one.channel: one for one in traces_of(parts, ('off',))}
    for axis in 'xy':
        drawn = float(np.nanmax(np.abs(traces[axis].errors['off'])))
        assert drawn == pytest.approx(rows[f'largest |{axis.upper()}| error [m]'], rel=1e-9)
    figure = path_picture(ReportData('', Headline(''), ('off',), traces=tuple(traces.values())),
                          parts[0][0].recording)
    legends = [axes.get_legend() for axes in figure.axes[1:]]
    labels = [one.get_texts()[0].get_text() for one in legends if one]
    assert labels == [f'|{axis}| ≤ {rows[f"largest |{axis}| error [m]"]:.3g} m' for axis in 'XY']


def test_the_table_has_the_errors_and_the_papers_bounds(
        paper: NamedPlant, drive: Callable[[str], Recording]) -> None:
    (segment,) = segments(drive('s_bend'))
    prediction = replay(paper.plant, segment)
    moved = _changed(segment, prediction, 'y', 0.25)
    table = error_table('all', [(segment, {'a': prediction, 'b': moved})], ('a', 'b'))
    rows = {row.name: row.values for row in table.rows}
    assert rows['largest |Y| error [m]']['b'] == pytest.approx(0.25, abs=0.01)
    assert rows['position [m]']['b'] == channel_errors(segment, moved)['position'].rmse


def test_a_steady_change_has_a_narrow_interval_and_chance_a_wide_one(
        paper: NamedPlant, drive: Callable[[str], Recording]) -> None:
    (segment,) = segments(drive('circle'))
    prediction = replay(paper.plant, segment)
    far, near = (_changed(segment, prediction, 'wheel_left', by) for by in (0.4, 0.2))
    low, high = change_intervals([(segment, {'a': far, 'b': near})], 'a', 'b')['wheel_left']
    assert low - 1e-9 <= 0.5 <= high + 1e-9
    assert high - low < 0.1
    noisy = np.array(prediction.values)
    noisy[:, prediction.names.index('wheel_left')] += np.random.default_rng(1).normal(
        0.0, 0.4, len(noisy))
    other = TimeSeries(prediction.times, noisy, prediction.names)
    low, high = change_intervals([(segment, {'a': far, 'b': other})], 'a', 'b')['wheel_left']
    assert low < 1.0 < high


def test_a_rival_on_another_clock_and_in_another_frame(
    drive: Callable[[str], Recording],
) -> None:
    truth = drive('s_bend')
    (segment,) = segments(truth)
    turn, shift = 2.0, 4.0
    x, y, heading = truth.streams['pose'].values.T
    pose = np.column_stack((np.cos(turn) * x - np.sin(turn) * y + 7.0,
                            np.sin(turn) * x + np.cos(turn) * y - 9.0, heading + turn))
    streams = {**truth.streams,
               'pose': TimeSeries(truth.streams['pose'].times, pose, ('x', 'y', 'heading'))}
    later = {name: TimeSeries(series.times + shift, series.values, series.names)
             for name, series in streams.items()}
    rival = Recording('engine', 'engine', later, 5 * 10**17)
    prediction = rival_prediction(rival, truth, segment)
    assert max(tracking(segment, prediction).bounds) < 2e-3
