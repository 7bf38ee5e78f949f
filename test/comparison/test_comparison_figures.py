# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures draw what they are given, and touch nothing else."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.comparison import replay, tracking
from lg_husky_sim.comparison.figures import (
    draw_response,
    draw_tracking_error,
    draw_trajectory,
    line_styles,
    responses_figure,
    trajectory_figure,
)
from lg_husky_sim.comparison.models import NamedPlant
from lg_husky_sim.comparison.rival import rival_prediction
from lg_husky_sim.recording import Recording, segments
from lg_husky_sim.signals import TimeSeries
import numpy as np
import pytest

matplotlib = pytest.importorskip('matplotlib')


def test_responses_and_trajectory(
    paper: NamedPlant, drive: Callable[[str], Recording],
) -> None:
    before = dict(matplotlib.rcParams)
    (segment,) = segments(drive('circle'))
    prediction = {'paper': replay(paper.plant, segment)}
    styles = line_styles(['paper'])
    figure = responses_figure(segment, prediction, styles, 'a drive', longest=10.0)
    titles = [axes.get_title(loc='left') for axes in figure.axes]
    assert titles == ['(a) Left wheels', '(b) Right wheels', '(c) Linear velocity',
                      '(d) Rotational velocity']
    for axes in figure.axes:
        measured, predicted = axes.get_lines()
        assert (measured.get_label(), predicted.get_label()) == ('measured', 'paper')
        assert np.nanmax(np.asarray(predicted.get_xdata(), dtype=float)) <= 10.0
    assert 'a drive – first 10 s of 27 s' in [text.get_text() for text in figure.texts]
    tracks = {'paper': tracking(segment, prediction['paper'])}
    figure = trajectory_figure(segment, tracks, styles, 'a drive')
    assert figure.axes[0].get_aspect() == 1.0
    np.testing.assert_array_equal(
        np.column_stack(figure.axes[0].get_lines()[0].get_data()), tracks['paper'].measured)
    assert dict(matplotlib.rcParams) == before


def test_a_silence_is_no_line_and_a_spike_does_not_flatten() -> None:
    from matplotlib.figure import Figure
    axes = Figure().subplots()
    times = np.concatenate((np.arange(0.0, 5.0, 0.01), np.arange(8.0, 12.0, 0.01)))
    values = np.sin(times)[:, None]
    values[300] = 1000.0
    measured = TimeSeries(times, values, ('forward',))
    draw_response(axes, measured, {}, 'forward', {}, start=0.0)
    drawn = np.asarray(axes.get_lines()[0].get_xydata())
    assert np.isnan(drawn[:, 1]).sum() == 1
    assert axes.get_ylim()[1] < 3.0
    assert axes.get_ylabel() == 'm/s'


def test_bounds_stand_in_the_legend(
    paper: NamedPlant, drive: Callable[[str], Recording],
) -> None:
    from matplotlib.figure import Figure
    (segment,) = segments(drive('s_bend'))
    prediction = replay(paper.plant, segment)
    moved = np.array(prediction.values)
    moved[1:, prediction.names.index('y')] += 0.25
    track = tracking(segment, TimeSeries(prediction.times, moved, prediction.names))
    axes = Figure().subplots()
    draw_tracking_error(axes, {'model': track}, 1, line_styles(['model']))
    legend = axes.get_legend()
    assert legend is not None
    (text,) = [text.get_text() for text in legend.get_texts()]
    assert text.startswith('model: |Y| ≤ 0.25')
    draw_trajectory(axes, {'model': track}, line_styles(['model']))


def test_styles_tell_models_and_rivals_apart() -> None:
    styles = line_styles(['a', 'b', 'engine'], ['engine'])
    assert len({style.colour for style in styles.values()}) == 3
    assert [style.dash for style in styles.values()] == ['-', '-', '--']


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
