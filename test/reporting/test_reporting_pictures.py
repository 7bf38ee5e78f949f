# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Pictures draw what they are given, and touch nothing else; signals keep their extremes."""

from __future__ import annotations

from lg_husky_sim.reporting.advice import filled, names_in
from lg_husky_sim.reporting.data import Headline, ReportData, Trace
from lg_husky_sim.reporting.pictures import (
    draw_intervals,
    draw_signal,
    path_picture,
    png,
    responses_picture,
)
from lg_husky_sim.reporting.styles import column_styles
from lg_husky_sim.reporting.thinning import longest_stretch, paired, thinned
from lg_husky_sim.reporting.words import change, number, padded, quantity_with_unit
import numpy as np
import pytest

matplotlib = pytest.importorskip('matplotlib')
TIMES = np.linspace(0.0, 20.0, 1001)


def _trace(channel: str, offset: float = 0.25) -> Trace:
    values = np.sin(TIMES)
    return Trace('a $drive$', channel, TIMES, values, {'model': values - offset})


def test_responses_have_the_papers_four_panels() -> None:
    before = dict(matplotlib.rcParams)
    data = ReportData('x', Headline('x'), ('model',), traces=tuple(
        map(_trace, ('wheel_left', 'wheel_right', 'forward', 'yaw_rate'))))
    figure = responses_picture(data, 'a $drive$', longest=10.0)
    assert [axes.get_title(loc='left') for axes in figure.axes] == [
        '(a) Left wheel rate', '(b) Right wheel rate', '(c) Forward speed', '(d) Yaw rate']
    for axes in figure.axes:
        measured, predicted = axes.get_lines()
        assert (measured.get_label(), predicted.get_label()) == ('measured', 'model')
        assert np.max(np.asarray(predicted.get_xdata(), dtype=float)) <= 10.0
    assert any('first 10 s of 20 s' in text.get_text() for text in figure.texts)
    assert png(figure).startswith(b'\x89PNG')  # and the dollar signs are no formula
    assert dict(matplotlib.rcParams) == before


def test_the_path_has_one_scale_and_the_largest_errors() -> None:
    data = ReportData('x', Headline('x'), ('model',), traces=(_trace('x'), _trace('y', 0.5)))
    path, upper, lower = path_picture(data, 'a $drive$').axes
    assert path.get_aspect() == 1.0
    for axes, words in ((upper, '|X| ≤ 0.25 m'), (lower, '|Y| ≤ 0.5 m')):
        legend = axes.get_legend()
        assert legend is not None
        assert [text.get_text() for text in legend.get_texts()] == [words]
        error = np.asarray(axes.get_lines()[1].get_ydata(), dtype=float)
        assert np.all(error > 0.0)  # measured minus predicted


def test_a_spike_does_not_flatten_the_rest() -> None:
    from matplotlib.figure import Figure
    values = np.sin(TIMES)
    values[300] = 1000.0
    axes = Figure().subplots()
    draw_signal(axes, Trace('r', 'forward', TIMES, values, {}), column_styles(()))
    assert axes.get_ylim()[1] < 3.0
    assert axes.get_ylabel() == '[m/s]'


def test_intervals_are_drawn_about_their_estimates() -> None:
    from matplotlib.figure import Figure
    axes = Figure().subplots()
    draw_intervals(axes, [('mass', 'kg', 50.0, 45.0, 60.0)])
    np.testing.assert_allclose(np.asarray(axes.get_lines()[0].get_xdata(), float), [-10.0, 20.0])
    assert [label.get_text() for label in axes.get_yticklabels()] == ['mass = 50 kg']


def test_thinning_keeps_extremes_and_gaps() -> None:
    values = np.sin(np.linspace(0.0, 300.0, 20_000))
    values[7777], values[5000:5003] = 9.0, np.nan
    trace = thinned(Trace('r', 'forward', np.linspace(0.0, 400.0, 20_000), values, {
        'model': values - 0.1}), 500)
    assert trace.times.size < 700
    assert np.nanmax(trace.measured) == 9.0
    assert np.isnan(trace.measured).any()
    assert (trace.times[0], trace.times[-1]) == (0.0, 400.0)


def test_x_and_y_of_a_path_stay_at_the_same_times() -> None:
    gone = np.array(np.sin(TIMES))
    gone[501] = np.nan
    x, y = paired(Trace('r', 'x', TIMES, gone, {}), _trace('y'), 200)
    np.testing.assert_array_equal(x.times, y.times)
    assert x.times.size <= 201
    assert np.isnan(x.measured).sum() == 1


def test_the_stretch_with_the_largest_error_is_found() -> None:
    error = np.where((TIMES > 11.0) & (TIMES < 13.0), 1.0, 0.0)
    start, end = longest_stretch(TIMES, error, 4.0)
    assert start <= 11.02
    assert end >= 12.98
    assert end - start == pytest.approx(4.0)


@pytest.mark.parametrize(('value', 'text', 'table'), [
    (0.0, '0', '0.00'), (6.0, '6', '6.00'), (-0.1234, '−0.123', '−0.123'), (251.3, '251', '251'),
    (123456.0, '123456', '123456'), (1.5e-7, '1.5e−07', '1.5e−07'), (float('nan'), '–', '–')])
def test_numbers_are_written_in_one_way(value: float, text: str, table: str) -> None:
    assert number(value) == text
    assert padded(value) == table


def test_changes_have_a_sign() -> None:
    assert (change(2.0, 1.0), change(1.0, 2.0)) == ('−50\u00a0%', '+100\u00a0%')
    assert (change(1.0, 25.0), change(0.0, 1.0)) == ('×25.0', '–')


def test_every_quantity_has_a_name_and_an_unknown_one_its_key() -> None:
    assert quantity_with_unit('wheel_left') == 'left wheel rate [rad/s]'
    assert quantity_with_unit('odd_thing') == 'odd thing'


def test_advice_names_only_what_was_found() -> None:
    sentences = ('Set `max_yaw: {limit_yaw}`.', 'Set `max_forward: {limit_forward}`.',
                 'The {side} side, {change:+.1%}.')
    assert filled(sentences, {'limit_yaw': 0.50123, 'side': 'left', 'change': -0.0569}) == (
        'Set `max_yaw: 0.501`.', 'The left side, −5.7\N{NO-BREAK SPACE}%.')
    assert names_in(sentences[2]) == {'side', 'change'}
