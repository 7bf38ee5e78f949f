# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Where an effect may begin in recordings of several segments."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import evidence_of
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.selection.onsets import onsets_of
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.effects import OnsetKind
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import TimeSeries
from lg_husky_sim.threads import Threads
import numpy as np
import pytest


def gaps(recording: Recording, *stretches: tuple[float, float]) -> Recording:
    """Return a recording in which nothing was heard for some stretches."""
    def kept(series: TimeSeries) -> TimeSeries:
        times = series.times - recording.streams['command'].times[0]
        keep = np.all([(times < begin) | (times > end) for begin, end in stretches], axis=0)
        return TimeSeries(series.times[keep], series.values[keep], series.names)
    return replace(recording, streams={
        name: kept(series) for name, series in recording.streams.items()})


def test_times_keep_away_from_the_edges_of_a_recording_and_not_of_its_segments(
        drive: Callable[..., Recording]) -> None:
    """An effect may begin just before or after a gap: its readings are on both sides."""
    names = ['first', 'second']
    drives = drives_of([gaps(drive(name, 'nothing', 1), (6.0, 8.0), (10.5, 12.5))
                        for name in names])
    assert [d.recording for d in drives] == [*(3 * ['first']), *(3 * ['second'])]
    model = load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        found = onsets_of(evidence_of(drives, names, start, first_guess(drives), pool))
    edge, spacing = setting('onset_edge'), setting('onset_spacing')
    for number, one in enumerate(drives):
        begin = one.start + (edge if number == 0 else 0.0)
        end = one.end - (edge if number in (2, 5) else 0.0)
        times = [onset.value for onset in found
                 if onset.kind is OnsetKind.TIME and onset.recording == one.recording
                 and one.start <= onset.value <= one.end]
        assert times[0] == pytest.approx(begin)
        assert 0.0 < end - times[-1] <= spacing + 1e-9
