# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of a report: its words, its numbers, and what it lets nobody do."""

from __future__ import annotations

from base64 import b64decode
import gzip
import html
import json
from pathlib import Path
import re
from typing import Any

from lg_husky_sim.reporting.data import (
    diagnosis_trace,
    ErrorRow,
    ErrorTable,
    Headline,
    Mismatch,
    NOMINAL,
    ParameterRow,
    Provenance,
    RECALIBRATED,
    ReportData,
    Trace,
    WITH_FINDING,
)
from lg_husky_sim.reporting.page import code, error_cells, jumps_of, parameter_rows, said
from lg_husky_sim.reporting.sections import Cell, Drawing, Section, Tone
from lg_husky_sim.reporting.write import write_report
import numpy as np
import pytest

for needed in ('matplotlib', 'jinja2'):
    pytest.importorskip(needed)

COLUMNS = (NOMINAL, RECALIBRATED, WITH_FINDING)
HOSTILE = '</script><img src=x onerror=alert(1)>'


def _trace(channel: str = 'wheel_left', recording: str = 'rec1', count: int = 500) -> Trace:
    times = np.linspace(0.0, 0.02 * (count - 1), count)
    measured = np.sin(times)
    return diagnosis_trace(recording, channel, times, measured, measured + 0.3, measured + 0.2,
                           measured + 0.1, np.full(count, 0.05))


def _data(**more: Any) -> ReportData:
    given: dict[str, Any] = {
        'title': 'Diagnosis of rec1', 'headline': Headline('Missing effect found: torque ripple'),
        'columns': COLUMNS, 'traces': (_trace(), _trace('x'), _trace('y')), **more}
    return ReportData(**given)


def _written(folder: Path, data: ReportData) -> str:
    write_report(data, folder)
    return (folder / 'report.html').read_text(encoding='utf-8')


def _live(page: str) -> dict[str, Any]:
    text = re.search(r'id="report-data">(.*?)</script>', page, re.DOTALL)
    assert text is not None
    found: dict[str, Any] = json.loads(text.group(1))
    return found


def test_untrusted_text_stays_text(tmp_path: Path) -> None:
    """Names of files and topics end no element and start none, in the page or in its data."""
    page = _written(tmp_path, _data(
        title=HOSTILE, traces=(_trace(recording=HOSTILE),),
        headline=Headline(HOSTILE, facts=((HOSTILE, HOSTILE),), sentences=(HOSTILE,),
                          warnings=(f'`{HOSTILE}`',)),
        mismatches=(Mismatch(HOSTILE, 'wheel_left', 1.0, 2.0, 5.0, HOSTILE),),
        notes=(f'an odd ` in {HOSTILE}',), provenance=Provenance('1', HOSTILE, (
            ('recording', HOSTILE, '0'),))))
    assert '<img src=x' not in page
    assert page.count(html.escape(HOSTILE)) >= 8
    assert page.count('</script>') == 3


def test_the_live_data_are_those_of_the_traces(tmp_path: Path) -> None:
    pytest.importorskip('plotly')
    live = _live(_written(tmp_path, _data()))
    assert [one['name'] for one in live['columns']] == list(COLUMNS)
    first = live['traces'][0]
    measured = np.frombuffer(b64decode(first['m']['f4']), '<f4')
    np.testing.assert_allclose(measured, np.sin(np.arange(500) * 0.02), atol=1e-6)
    recalibrated = np.frombuffer(b64decode(first['p'][1]['f4']), '<f4')
    np.testing.assert_allclose(measured - recalibrated, -0.2, atol=1e-6)
    assert first['s'] == 0.05


def test_plotly_travels_inside_the_page(tmp_path: Path) -> None:
    pytest.importorskip('plotly')
    from plotly.offline import get_plotlyjs
    page = _written(tmp_path, _data())
    packed = re.search(r'id="plotly-gzip">([A-Za-z0-9+/=]+)</script>', page)
    assert packed is not None
    assert gzip.decompress(b64decode(packed.group(1))).decode() == get_plotlyjs()
    assert not re.search(r'(?:src|href)="(?!data:)', page)


def test_without_plotly_the_page_has_its_pictures(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setattr('lg_husky_sim.reporting.page.packed_library', lambda: '')
    page = _written(tmp_path, _data())
    assert '<script' not in page
    assert page.count('src="data:image/png;base64,') == 3


def test_a_page_of_long_recordings_stays_below_five_megabytes(tmp_path: Path) -> None:
    """Ten minutes at 100 Hz, three times; extremes survive, and so does every gap."""
    traces = []
    for number in range(3):
        for channel in ('wheel_left', 'wheel_right', 'forward', 'yaw_rate', 'x', 'y'):
            noise = np.random.default_rng(number).normal(size=60_000)
            noise[30_000], noise[1234] = np.nan, 50.0
            traces.append(Trace(f'rec{number}', channel, np.linspace(0.0, 600.0, 60_000), noise,
                                dict.fromkeys(COLUMNS, noise + 0.1)))
    page = _written(tmp_path, _data(traces=tuple(traces)))
    assert len(page.encode()) < 5_000_000
    if '<script' not in page:
        return
    for one in _live(page)['traces']:
        values = np.frombuffer(b64decode(one['m']['f4']), '<f4')
        assert np.isnan(values).sum() >= 1
        if one['c'] not in ('x', 'y'):
            assert np.nanmax(values) == 50.0


def test_a_picture_that_fails_is_a_line_of_the_report(tmp_path: Path) -> None:
    def broken() -> Any:
        raise ValueError("no branch 'J_RL' in the graph")
    page = _written(tmp_path, _data(sections=(
        Section('Where in the model', drawings=(Drawing('graph', 'the graph', broken),)),)))
    assert 'graph.png could not be drawn: ValueError: no branch &#39;J_RL&#39;' in page
    assert (tmp_path / 'before_after.png').is_file()
    assert not (tmp_path / 'graph.png').exists()


def test_remarks_are_sentences_and_names_stay_as_they_are() -> None:
    assert said('residuals are autocorrelated') == 'Residuals are autocorrelated.'
    assert said('rec1: 3 samples were dropped.') == 'rec1: 3 samples were dropped.'


def _changes(table: ErrorTable) -> list[tuple[str, Tone]]:
    cells = [row[-1] for row in error_cells(table).rows]
    return [(cell.text, cell.tone) for cell in cells if isinstance(cell, Cell)]


def test_a_loss_is_as_visible_as_a_gain() -> None:
    table = ErrorTable('held out', (
        ErrorRow('position [m]', {NOMINAL: 0.4, RECALIBRATED: 0.05, WITH_FINDING: 0.1}),
        ErrorRow('yaw rate [rad/s]', {NOMINAL: 0.4, RECALIBRATED: 0.2, WITH_FINDING: 0.1}),
        ErrorRow('heading [rad]', {NOMINAL: 0.4, RECALIBRATED: 0.2, WITH_FINDING: 0.2}),
        ErrorRow('wheel rate [rad/s]', {RECALIBRATED: 0.2, WITH_FINDING: 0.21}, 0.9, 1.2),
        ErrorRow('forward speed [m/s]', {RECALIBRATED: 0.8802, WITH_FINDING: 0.8809}),
    ), COLUMNS, compared=(RECALIBRATED, WITH_FINDING))
    assert _changes(table) == [
        ('+100\u00a0% worse', Tone.BAD), ('−50\u00a0%', Tone.GOOD), ('+0\u00a0%', Tone.PLAIN),
        ('+5\u00a0% (−10\u00a0to +20\u00a0%)', Tone.PLAIN), ('+0\u00a0%', Tone.PLAIN)]


def test_errors_that_are_all_but_zero_are_neither_better_nor_worse() -> None:
    """As of a drive that the twin itself simulated: both are what rounding leaves."""
    table = ErrorTable('held out', (
        ErrorRow('yaw rate [rad/s]', {NOMINAL: 3.3e-16, RECALIBRATED: 8.2e-6}),
        ErrorRow('position [m]', {NOMINAL: 8e-4, RECALIBRATED: 4e-4}),
        ErrorRow('wheel rate [rad/s]', {NOMINAL: 3.7e-13, RECALIBRATED: 0.02}),
    ), (NOMINAL, RECALIBRATED), compared=(NOMINAL, RECALIBRATED))
    assert _changes(table) == [
        ('both near 0', Tone.PLAIN), ('both near 0', Tone.PLAIN), ('over ×1000 worse', Tone.BAD)]


def test_models_side_by_side_have_their_best_marked() -> None:
    table = ErrorTable('rec1', (ErrorRow('x [m]', {'a': 0.2, 'b': 0.1}),), ('a', 'b'))
    _, first, second = error_cells(table).rows[0]
    assert isinstance(first, Cell)
    assert isinstance(second, Cell)
    assert (first.tone, second.tone) == (Tone.PLAIN, Tone.GOOD)
    assert (first.bar, second.bar) == (1.0, 0.5)


def test_a_parameter_is_drawn_within_what_the_fit_allows() -> None:
    inside, edge, free = parameter_rows((
        ParameterRow('mass', 'kg', 50.0, 55.0, 52.0, 58.0, 40.0, 60.0),
        ParameterRow('track', 'm', 0.5, 0.6, 0.58, 0.65, 0.4, 0.6, True),
        ParameterRow('gain', '1', 1.0, 2.0)))
    assert (inside['left'], inside['width'], inside['value_at']) == ('60.0', '30.0', '75.0')
    assert inside['change'] == '+10.0\u00a0%'
    assert edge['at_bound']
    assert float(edge['left']) + float(edge['width']) == 100.0  # cut off, not drawn beside it
    assert not free['drawn']
    (typed,) = parameter_rows([ParameterRow('wheel_damping', '1', 1.0, 2.0)])
    assert typed['name'] == 'wheel_<wbr>damping'
    assert free['interval'] == '–'


def test_an_interval_has_digits_that_tell_it_from_the_estimate() -> None:
    (near,) = parameter_rows([ParameterRow('side_gain_ratio', '1', 1.0, 1.00003, 0.99984, 1.0002)])
    assert (near['value'], near['interval']) == ('1', '0.99984 to 1.0002')
    (exact,) = parameter_rows([ParameterRow('wheel_radius', 'm', 0.1651, 0.1651, 0.1651, 0.1651)])
    assert exact['interval'] == '0.1651 to 0.1651'


def test_any_mismatch_of_a_recording_with_signals_can_be_shown() -> None:
    """That of the heading has no signal of its own, but a time."""
    data = _data(mismatches=tuple(Mismatch(recording, channel, 1.0, 2.0, 5.0, '') for recording,
                                  channel in (('rec1', 'wheel_left'), ('rec1', 'heading'),
                                              ('elsewhere', 'heading'))))
    assert jumps_of(data) == {0: 0, 1: 1}


def test_backquotes_are_code_and_escaped() -> None:
    assert code('set `a<b`') == 'set <code>a&lt;b</code>'
    assert code('one ` alone <') == 'one ` alone &lt;'


def test_traces_of_unequal_length_are_refused() -> None:
    with pytest.raises(ValueError, match=r'wheel_left of rec1: \[2, 3\] values'):
        Trace('rec1', 'wheel_left', np.zeros(3), np.zeros(2), {})
