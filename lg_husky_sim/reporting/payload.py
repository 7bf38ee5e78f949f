# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What the live part of a page draws, as JSON; and the library that draws it."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
import gzip
from importlib.util import find_spec
import json
import math
from typing import Any

from lg_husky_sim.reporting.data import ReportData, Trace, View
from lg_husky_sim.reporting.sections import Chart
from lg_husky_sim.reporting.styles import column_styles, PALETTE
from lg_husky_sim.reporting.thinning import paired, thinned
from lg_husky_sim.reporting.words import QUANTITIES, quantity
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Numbers in all traces of a page; 4 bytes each, a third more as text: about 0.9 MB.
BUDGET = 160_000
#: Samples of one trace: fewer show nothing, more cannot be seen.
FEWEST, MOST = 150, 4000
#: Times beyond this need 8 bytes to keep a millisecond [s].
LONG = 4000.0
#: Channels that make up the path and stand in no panel of signals.
PLACE = ('x', 'y')


@cache
def packed_library() -> str:
    """
    Return plotly's JavaScript, packed by gzip and in base64; empty where it is not installed.

    Returns
    -------
    str
        Some 2 MB of letters that need no escaping.

    """
    if find_spec('plotly') is None:
        return ''
    from plotly.offline import get_plotlyjs
    return b64encode(gzip.compress(get_plotlyjs().encode('utf-8'), 9, mtime=0)).decode('ascii')


def _packed(values: FloatArray) -> dict[str, str]:
    wide = bool(np.nanmax(np.abs(values), initial=0.0) > LONG)
    kind = '<f8' if wide else '<f4'
    return {'f8' if wide else 'f4': b64encode(values.astype(kind).tobytes()).decode('ascii')}


def _sigma(trace: Trace) -> object:
    if trace.sigma is None or not trace.sigma.size:
        return None
    first = float(trace.sigma[0])
    return first if bool(np.all(trace.sigma == first)) else _packed(trace.sigma)


def shown_traces(data: ReportData) -> list[Trace]:
    """Return the traces of a page, thinned so that all of them fit."""
    each = sum(2 + len(trace.predicted) for trace in data.traces)
    most = min(MOST, max(FEWEST, BUDGET // max(each, 1)))
    found: list[Trace] = []
    for trace in data.traces:
        other = data.trace(trace.recording, 'x' if trace.channel == 'y' else 'y')
        if trace.channel in PLACE and other is not None:
            pair = (trace, other) if trace.channel == 'x' else (other, trace)
            found.append(paired(*pair, min(most, MOST // 2))[trace.channel == 'y'])
        else:
            found.append(thinned(trace, most))
    return found


def _chart(chart: Chart) -> dict[str, Any]:
    return {'name': chart.name, 'x': chart.x_title, 'y': chart.y_title, 'log': chart.logarithmic,
            'lines': [{'label': one.label, 'x': _packed(np.asarray(one.x, dtype=np.float64)),
                       'y': _packed(np.asarray(one.y, dtype=np.float64)),
                       's': None if one.spread is None else _packed(one.spread),
                       'dots': one.dots} for one in chart.lines]}


def payload(data: ReportData, view: View | None, jumps: Mapping[int, int]) -> str:
    """
    Return the data of the live part as JSON that may stand in a page.

    Parameters
    ----------
    data : ReportData
        What the report shows; its traces are packed.
    view : View or None
        What is shown first.
    jumps : mapping of int to int
        Mismatches that can be shown: place in `data.mismatches` by place in the page.

    Returns
    -------
    str
        Without the letter ``<``, so that nothing in it can end the script element.

    """
    recordings, traces = list(data.recordings), shown_traces(data)
    styles = column_styles(data.columns)
    channels = {trace.channel: {
        'name': quantity(trace.channel), 'unit': QUANTITIES.get(trace.channel, ('', ''))[1],
        'place': trace.channel in PLACE} for trace in traces}
    picked = [data.mismatches[place] for place in jumps.values()]
    text = json.dumps({
        'columns': [{'name': name, 'light': style.light, 'dark': style.dark, 'dash': style.dash}
                    for name, style in styles.items()],
        'palette': PALETTE, 'recordings': recordings, 'channels': channels,
        'traces': [{'r': recordings.index(trace.recording), 'c': trace.channel,
                    't': _packed(trace.times), 'm': _packed(trace.measured),
                    'p': [_packed(trace.predicted[name]) if name in trace.predicted else None
                          for name in data.columns],
                    's': _sigma(trace)} for trace in traces],
        'view': None if view is None else {
            'r': recordings.index(view.recording), 'c': view.channel, 'start': view.start,
            'end': view.end, 'onset': view.onset if math.isfinite(view.onset) else None},
        'jumps': [{'r': recordings.index(one.recording), 'c': one.channel, 'start': one.start,
                   'end': one.end} for one in picked],
        'charts': [_chart(chart) for section in data.sections for chart in section.charts],
    }, ensure_ascii=False, allow_nan=False)
    return text.replace('<', '\\u003c')


def of_first_recordings(data: ReportData, recordings: int) -> ReportData:
    """Return the data with the traces of its first recordings only."""
    kept = set(data.recordings[:recordings])
    return data if len(data.recordings) <= recordings else replace(
        data, traces=tuple(trace for trace in data.traces if trace.recording in kept))
