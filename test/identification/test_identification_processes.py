# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Processes that share the work end with the one who asked, however he ends."""

from __future__ import annotations

from pathlib import Path
import signal
import subprocess
import sys
import time

import pytest

PROGRAM = """
import os, signal, time
from lg_husky_sim.identification.executor import processes
if __name__ == '__main__':
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with processes(2) as pool:
            print(pool.submit(os.getpid).result(), flush=True)
            pool.submit(time.sleep, 300).result()
    except KeyboardInterrupt:
        print('interrupted', flush=True)
"""


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_no_process_outlives_the_one_who_asked(number: signal.Signals, tmp_path: Path) -> None:
    """Asked to stop or killed, while a task would go on for minutes; and without a traceback."""
    program = tmp_path / 'program.py'
    program.write_text(PROGRAM, encoding='utf-8')
    with subprocess.Popen([sys.executable, str(program)], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True) as asked:
        assert asked.stdout is not None
        child = Path('/proc') / asked.stdout.readline().strip()
        assert child.exists()
        asked.send_signal(number)
        said, errors = asked.communicate(timeout=60.0)
        for _ in range(300):
            if not child.exists():
                break
            time.sleep(0.1)
        assert not child.exists()
    assert said == 'interrupted\n' * (number is signal.SIGINT)
    assert 'Traceback' not in errors
