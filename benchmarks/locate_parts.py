# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
How often the smoother's strongest part is the one in which the physics was hidden.

    python benchmarks/locate_parts.py CASES ANSWERS

CASES holds folders ``NAME/recordings/*``, ANSWERS files ``NAME.json`` whose ``effects`` have a
``subsystem``, as the blind trial makes them. Pairs are left out.
"""

from __future__ import annotations

import json
from pathlib import Path
import sys

from lg_husky_sim.diagnosis.diagnose import usable_segments
from lg_husky_sim.diagnosis.fits import recalibrate
from lg_husky_sim.diagnosis.locate import locate
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.identification.problem import observations
from lg_husky_sim.recording import read_recording


def main(cases: Path, answers: Path) -> None:
    """Print a line a case, then the totals."""
    model = load_model()
    rows = []
    for answer in sorted(answers.glob('*.json')):
        parts = {e['subsystem'] for e in json.loads(answer.read_text())['effects']}
        places = sorted((cases / answer.stem / 'recordings').glob('*'))
        if len(parts) > 1 or not places:
            continue
        data = observations(usable_segments([read_recording(p) for p in places]))
        located = locate(data, recalibrate(data, model.structure, model.parameters))
        order = list(located.strengths)
        evidence = located.explanations[located.best()].evidence
        rows.append((parts, order, located.certain))
        print(f'{answer.stem:12} {", ".join(parts) or "clean":12} {order[0]:12} {order[1]:12} '
              f'{evidence:10.0f} nats', flush=True)
    clean = [r for r in rows if not r[0]]
    seen = [r for r in rows if r[0] and r[2]]
    print(f'evidence in {len(seen)} of {len(rows) - len(clean)} cases, and in '
          f'{sum(r[2] for r in clean)} of {len(clean)} clean ones; of those '
          f'{sum(r[1][0] in r[0] for r in seen)} right first, '
          f'{sum(bool(set(r[1][:2]) & r[0]) for r in seen)} right among the first two')


if __name__ == '__main__':
    main(Path(sys.argv[1]), Path(sys.argv[2]))
