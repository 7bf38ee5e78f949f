# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Diagnose the first half of a recording alone, and predict the second half.

    python benchmarks/first_half.py REC [REC ...] [--jobs N]

What is missing is chosen and fitted on the first half of the time; the second half is only driven,
by its commands and its initial states. The last column is the model whose recalibration is all
that was allowed.
"""

from __future__ import annotations

import argparse
import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lg_husky_sim.recording import Recording


def part(recording: Recording, start: float, end: float) -> Recording:
    """Return a stretch of a recording, still on its clock."""
    from lg_husky_sim.recording import Recording
    streams = {name: series.slice(start, end) for name, series in recording.streams.items()}
    return Recording(recording.name, recording.path,
                     {name: series for name, series in streams.items() if len(series)},
                     recording.start_ns, frames=recording.frames)


def main() -> None:
    """Print what was found in each first half, and the errors on the second halves."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('recordings', nargs='+')
    parser.add_argument('--jobs', type=int, default=os.cpu_count() or 1)
    given = parser.parse_args()
    # Many small matrices: threads of the linear algebra cost more than they bring.
    os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
    from lg_husky_sim.diagnosis.diagnose import diagnose
    from lg_husky_sim.diagnosis.held_out import errors, plant_of
    from lg_husky_sim.diagnosis.workers import Workers
    from lg_husky_sim.husky.model import compile_model
    from lg_husky_sim.husky.model_file import load_model
    from lg_husky_sim.recording import read_recording, segments
    nominal = load_model()
    for path in given.recordings:
        recording = read_recording(path)
        last = max(float(series.times[-1]) for series in recording.streams.values())
        middle = 0.5 * last
        first, second = part(recording, 0.0, middle), part(recording, middle, last)
        with Workers(given.jobs) as workers:
            case = diagnose([first], nominal, lambda text, share: None, workers=workers)
        held = segments(second)
        before = errors(plant_of(case.search.plain), held)
        model = case.diagnosis.model
        after = errors(compile_model(model.structure).at(model.parameters), held)
        paper = errors(compile_model(nominal.structure).at(nominal.parameters), held)
        print(f'{recording.name}: first {middle:.0f} s of {last:.0f} s')
        for finding in case.diagnosis.findings:
            print(f'  {finding.statement}')
        print(f'  {"second half":22} {"paper":>10} {"found":>10} {"recalibrated":>14}')
        for name, value in before.items():
            print(f'  {name:22} {paper[name]:10.4g} {after[name]:10.4g} {value:14.4g}')


if __name__ == '__main__':
    main()
