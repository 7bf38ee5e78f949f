# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
When a hidden effect begins: the diagnosis beside general change-point methods (ruptures).

Run ``pip install ruptures``, ``lg_husky prove --cases 120 --seed 7001 --generate-only --out DIR``
and ``python benchmarks/onsets.py DIR``. Of all cases with one effect of the catalogue that begins
at a time, the methods of ruptures get the innovations of the recalibrated model, as the diagnosis
has them, as means over bins of each channel, and are told that there is one change.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
import json
import math
from pathlib import Path
from typing import Any
import warnings

import lg_husky_sim as lg
from lg_husky_sim.diagnosis.evidence.drives import Channel
from lg_husky_sim.diagnosis.selection.search import Search
from lg_husky_sim.parallel import map_tasks
from lg_husky_sim.signals import FloatArray
import numpy as np
import ruptures
from tqdm import tqdm

#: Width of the bins [s], and what counts as found [s].
BIN, NEAR, NEARER = 0.1, 2.0, 0.5


@dataclass(frozen=True)
class Bins:
    """Innovations of all recordings, one after the other: rows and where each of them is."""

    rows: FloatArray
    recording: tuple[str, ...]
    times: FloatArray


def innovations(search: Search) -> Bins:
    """Return the innovations of the recalibrated model, in bins."""
    rows, names, times = [], [], []
    ends = np.cumsum([d.measured.size for d in search.evidence.drives])
    for drive, whitener, end in zip(search.evidence.drives, search.evidence.whiteners, ends,
                                    strict=True):
        order, frame = whitener.frame.order, whitener.frame
        own = search.plain.whitened[end - drive.measured.size:end]
        at, channels = frame.times[order], drive.channels[order]
        edges = np.arange(drive.start, drive.end, BIN)
        place = np.digitize(at, edges) - 1
        inside = (place >= 0) & (place < edges.size)
        bins, counts = np.zeros((2, edges.size, len(Channel)))
        np.add.at(bins, (place[inside], channels[inside]), own[inside])
        np.add.at(counts, (place[inside], channels[inside]), 1.0)
        rows.append(bins / np.sqrt(np.maximum(counts, 1.0)))
        names += [drive.recording] * edges.size
        times.append(edges)
    found = np.vstack(rows)
    return Bins(found[:, np.ptp(found, axis=0) > 0.0], tuple(names), np.concatenate(times))


def _binary(rows: FloatArray) -> int:
    return int(ruptures.Binseg(model='l2').fit(rows).predict(n_bkps=1)[0])


def _normal(rows: FloatArray) -> int:
    return int(ruptures.Dynp(model='normal', min_size=20, jump=2).fit(rows).predict(n_bkps=1)[0])


def _kernel(rows: FloatArray) -> int:
    return int(ruptures.KernelCPD(kernel='rbf').fit(rows).predict(n_bkps=1)[0])


METHODS: dict[str, Callable[[FloatArray], int]] = {
    'binary segmentation, change of the mean': _binary,
    'dynamic programming, change of mean and covariance': _normal,
    'kernel change point (RBF)': _kernel,
}


def onset_of(answer: dict[str, Any]) -> dict[str, Any] | None:
    """Return where the effect of a case begins, if it is one and begins at a time."""
    true = answer['answers']
    if answer['kind'] != 'single' or len(true) != 1 or answer['level'] == 'undetectable':
        return None
    onset: dict[str, Any] = true[0]['onset'] or {}
    return onset if onset.get('type') == 'time' else None


def off(onset: dict[str, Any], recording: str | None, time: float | None) -> float:
    """Return how far a change point is from the true one [s]; infinity in other recordings."""
    if recording is None or time is None or Path(recording).name != onset['recording']:
        return math.inf
    return abs(time - float(onset['seconds_after_epoch']))


def errors(case: Path) -> tuple[str, str, dict[str, float]]:
    """Return what is hidden in a case, what is named, and how far each method is off [s]."""
    answer = json.loads((case.parents[1] / 'answers' / f'{case.name}.json').read_text())
    onset = onset_of(answer)
    assert onset is not None
    told = answer.get('robot') or {}
    ruler = told if 'track_m' in told else json.loads((case / 'robot.json').read_text())
    husky = lg.Husky().replacing(wheel_radius=ruler['wheel_radius_m'], track=ruler['track_m'])
    result = husky.diagnose(sorted(case.glob('rec*')), jobs=1, progress=False)
    bins = innovations(result.case.search)
    found = {}
    # That it keeps covariances from being singular.
    warnings.filterwarnings('ignore', module='ruptures')
    for name, method in METHODS.items():
        k = min(method(bins.rows), len(bins.recording) - 1)
        found[name] = off(onset, bins.recording[k], float(bins.times[k]))
    said = [f for f in result.diagnosis.findings if f.onset is not None]
    mine = said[0].onset if said else None
    found['diagnosis'] = off(onset, mine.recording, mine.value) if mine is not None else math.inf
    named = ', '.join(f.effect for f in result.diagnosis.findings) or 'nothing'
    return str(answer['answers'][0]['effect']), named, found


def main() -> None:
    """Print how often each method is near, and how far it is off."""
    parser = argparse.ArgumentParser(description='compare change points with those of ruptures')
    parser.add_argument('folder', type=Path, help='of a trial: with cases/ and answers/')
    parser.add_argument('--jobs', type=int, default=2)
    given = parser.parse_args()
    answers = sorted((given.folder / 'answers').glob('*.json'))
    cases = [given.folder / 'cases' / path.stem for path in answers
             if onset_of(json.loads(path.read_text()))]
    if not cases:
        parser.error(f'{given.folder} has no answer of one effect that begins at a time')
    names, table = [*METHODS, 'diagnosis'], []
    for case, (hidden, named, found) in zip(cases, tqdm(
            map_tasks(errors, cases, given.jobs), total=len(cases)), strict=True):
        table.append([found[name] for name in names])
        print(f'{case.name}: {hidden}, named {named}: '
              + ', '.join(f'{found[name]:.2f}' for name in names), flush=True)
    off_by = np.array(table)
    print(f'{len(cases)} cases; errors [s], infinity where the recording is another one')
    for name, column in zip(names, off_by.T, strict=True):
        print(f'{name}: within {NEARER} s {np.mean(column <= NEARER):.0%}, within {NEAR} s '
              f'{np.mean(column <= NEAR):.0%}, median {np.median(column):.2f}')


if __name__ == '__main__':
    main()
