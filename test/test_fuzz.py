# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The fuzzer of docs/reliability.md: a few inputs of every reader, and that it sees defects."""

from __future__ import annotations

from pathlib import Path
import subprocess
import sys

import pytest

pytest.importorskip('rosbags')
pytest.importorskip('cyclonedds')
pytest.importorskip('pandas')
FUZZ = Path(__file__).resolve().parent.parent / 'benchmarks' / 'fuzz.py'
DEFECTS = """
import sys
sys.path.insert(0, {folder!r})
import fuzz, fuzz_readers, os, time

def read(data, folder):
    match (data or b'x')[0] % 16:
        case 14: raise ZeroDivisionError('seen')
        case 13: os.kill(os.getpid(), 9)
        case 11:
            while True: pass
        case 3: raise fuzz_readers.LgHuskyError('refused')
        case 7: fuzz_readers.sensible(False, 'no sense')
fuzz.LONGEST, fuzz.MOST = 0.05, 200
reader = fuzz_readers.Reader('one', lambda folder: [bytes([15]) * 9], read)
tally = fuzz.run(reader, 1, 600, 60.0)
print(*tally.failures, sep='\\n')
"""


def test_every_reader_refuses_or_makes_sense_of_damaged_inputs(tmp_path: Path) -> None:
    """Thirty of each here; many more by benchmarks/fuzz.py."""
    ran = subprocess.run([sys.executable, str(FUZZ), '--inputs', '30', '--seconds', '120'],
                         cwd=tmp_path, capture_output=True, text=True, timeout=600, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert '| **all** | **360** |' in ran.stdout


def test_the_fuzzer_sees_errors_crashes_hangs_and_nonsense(tmp_path: Path) -> None:
    """Each kind of defect is reported; a refusal is none."""
    ran = subprocess.run([sys.executable, '-c', DEFECTS.format(folder=str(FUZZ.parent))],
                         cwd=tmp_path, capture_output=True, text=True, timeout=600, check=False)
    for text in ('ZeroDivisionError: seen', 'ended with -9', 'took more than 0.05 s', 'no sense'):
        assert text in ran.stdout, ran.stdout + ran.stderr
    assert 'refused' not in ran.stdout
