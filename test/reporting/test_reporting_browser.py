# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The live part of a report, in a browser: what its buttons, jumps and clicks do."""

from __future__ import annotations

from collections.abc import Callable
import math
from pathlib import Path
from typing import Any

from lg_husky_sim.reporting.data import (
    diagnosis_trace,
    ErrorRow,
    ErrorTable,
    Headline,
    Mismatch,
    NOMINAL,
    RECALIBRATED,
    ReportData,
    Trace,
    WITH_FINDING,
)
from lg_husky_sim.reporting.sections import Chart, Line, Section
from lg_husky_sim.reporting.write import write_report
import numpy as np
import pytest

for needed in ('matplotlib', 'jinja2', 'plotly'):
    pytest.importorskip(needed)

Visited = Callable[..., dict[str, Any]]
HOSTILE = '</script><b>rec2</b>'
END = 0.02 * 1500


def _trace(recording: str, channel: str) -> Trace:
    times = np.linspace(0.0, END, 1501)
    measured = times * 0.1 if channel == 'x' else np.sin(times)
    return diagnosis_trace(recording, channel, times, measured, measured + 0.3, measured + 0.2,
                           measured + 0.1, np.full(times.size, 0.05))


@pytest.fixture(scope='module')
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a report of two recordings, one of an odd name."""
    folder = tmp_path_factory.mktemp('report')
    line = Line('yaw moment', np.linspace(0.0, END, 9), np.arange(9.0), np.ones(9))
    columns = (NOMINAL, RECALIBRATED, WITH_FINDING)
    rows = tuple(ErrorRow(name, dict(zip(columns, (0.00881, 0.00327, 4.54e-7), strict=True)),
                          low, high)
                 for name, low, high in (('forward acceleration [m/s²]', 1e-4, 2e-4),
                                         ('largest |X| error [m]', math.nan, math.nan)))
    write_report(ReportData(
        'Diagnosis', Headline('Missing effect found'), columns,
        errors=(ErrorTable('All data', rows, columns, compared=(RECALIBRATED, WITH_FINDING)),),
        traces=tuple(_trace(recording, channel) for recording in ('rec1', HOSTILE)
                     for channel in ('wheel_left', 'yaw_rate', 'x', 'y')),
        mismatches=(Mismatch(HOSTILE, 'yaw_rate', 10.0, 14.0, 5.0, 'rotation'),
                    Mismatch('rec1', 'wheel_left', 4.0, 4.4, 3.0, 'drivetrain')),
        sections=(Section('The missing effort', charts=(
            Chart('effort_1', 'the effort', (line,), 'time [s]', '[N·m]'),)),)), folder)
    return folder / 'report.html'


@pytest.fixture(scope='module')
def seen(page: Path, visited: Visited) -> dict[str, Any]:
    """Return what a visit to it shows."""
    return visited(page)


def test_a_page_comes_to_life_with_all_that_it_draws(seen: dict[str, Any]) -> None:
    assert seen['alive']
    assert seen['recordings'] == ['rec1', HOSTILE]
    # Two panels of measured and three models; a band is two more lines, as errors have one.
    assert seen['values'] == [8, 'left wheel rate [rad/s]']
    assert seen['errors'] == [10, 'error of left wheel rate [rad/s]']
    assert seen['drawn'] == [4 + 5, 8, 5]
    assert seen['charts'] == [3]


def test_errors_are_measured_minus_predicted(seen: dict[str, Any]) -> None:
    """As in tables, still pictures and bags: each of these models predicts too much."""
    assert seen['signs'] == [-1, -1, -1]


def test_buttons_move_and_zoom_the_time_axis(seen: dict[str, Any]) -> None:
    low, high = seen['range']
    middle, wide = (low + high) / 2, high - low
    assert seen['in'] == pytest.approx([middle - wide / 4, middle + wide / 4])
    assert seen['on'] == pytest.approx([middle, middle + wide / 2])
    assert seen['back'] == pytest.approx(seen['in'])
    assert seen['out'] == pytest.approx([low, high])
    assert seen['all'] == pytest.approx([0.0, END], abs=0.05 * END)


def test_jumps_show_the_mismatch_in_its_recording(seen: dict[str, Any]) -> None:
    odd, first = seen['jumps']
    assert odd[0] == HOSTILE
    assert odd[1:] == pytest.approx([8.0, 16.0])
    assert first[0] == 'rec1'
    assert first[1:] == pytest.approx([3.0, 5.4])


def test_a_click_on_the_path_shows_the_signals_at_that_moment(seen: dict[str, Any]) -> None:
    assert seen['clicked'] == pytest.approx([1.0, 11.0])


def test_the_path_is_coloured_by_the_error_of_the_chosen_model(seen: dict[str, Any]) -> None:
    nominal, recalibrated, found = seen['coloured']
    assert nominal == pytest.approx(3.0 * found, rel=1e-3)
    assert recalibrated == pytest.approx(2.0 * found, rel=1e-3)


@pytest.mark.parametrize('dark', [False, True])
def test_a_page_fits_a_phone_in_light_and_dark(dark: bool, page: Path, visited: Visited) -> None:
    seen = visited(page, width=390, dark=dark)
    assert seen['size'] == [390, 390]
    assert seen['cut'][0] == 0  # the change of the errors is in sight
    assert max(seen['plots']) <= 390.0  # a plot is drawn for the screen that it is on
    shade = [int(part) for part in seen['dark'].strip('rgb()').split(',')[:3]]
    assert max(shade) < 64 if dark else min(shade) > 192
