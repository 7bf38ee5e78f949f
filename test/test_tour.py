# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""README's five minutes, run as they stand, but for the live node that would not end."""

from __future__ import annotations

import json
import os
from pathlib import Path
import re
import subprocess
import sys
import textwrap

import pytest

ROOT = Path(__file__).resolve().parent.parent


def tour() -> list[str]:
    """Return the lines of the tour's code block."""
    text = (ROOT / 'README.md').read_text(encoding='utf-8')
    section = text.split('## Five minutes')[1]
    match = re.search(r'```bash\n(.*?)```', section, re.DOTALL)
    assert match is not None
    return match.group(1).splitlines()


@pytest.fixture(scope='module')
def toured(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Run the tour in a folder with a `run` of this interpreter."""
    folder = tmp_path_factory.mktemp('tour')
    run = folder / 'run'
    run.write_text(textwrap.dedent(f"""\
        #!/bin/sh
        exec {sys.executable} -m lg_husky_sim.cli.main "$@"
    """))
    run.chmod(0o755)
    lines = [line for line in tour() if not line.startswith('./run sim_node')]
    assert len(lines) == len(tour()) - 1
    done = subprocess.run(['bash', '-e'], input='\n'.join(lines), cwd=folder, text=True,
                          capture_output=True, timeout=1200, check=False,
                          env={**os.environ, 'OMP_NUM_THREADS': '1'})
    assert done.returncode == 0, done.stderr[-3000:]
    return folder, done.stdout


def test_tour_shows_every_offline_step(toured: tuple[Path, str]) -> None:
    folder, said = toured
    for name in ('husky.svg', 'bend/metadata.yaml', 'before/index.html', 'fit.yaml', 'fit.html',
                 'found/diagnosis.json', 'found/model.yaml', 'after/index.html'):
        assert (folder / name).stat().st_size > 0, name
    assert 'Poles with the numbers of the model' in said
    # The sealed answer is one line, not a hundred of JSON.
    assert said.splitlines()[-1] == ' "name": "command_slew/medium",'


def test_tour_finds_what_was_hidden_and_the_fit_improves(toured: tuple[Path, str]) -> None:
    folder, _ = toured
    hidden = json.loads((folder / 'trial/answers/case_0001.json').read_text('utf-8'))['answers']
    found = json.loads((folder / 'found/diagnosis.json').read_text('utf-8'))
    assert found['verdict'] == 'known'
    assert [finding['effect'] for finding in found['findings']] == [
        effect['effect'] for effect in hidden]
    before, after = (json.loads((folder / name / 'compare.json').read_text('utf-8'))
                     for name in ('before', 'after'))
    (plain,), (augmented,) = before['overall'].values(), after['overall'].values()
    assert augmented['rmse']['position'] < 0.5 * plain['rmse']['position']
