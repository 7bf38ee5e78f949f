# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Each source file says whose it is and under which licence, as the LICENSE file does."""

from __future__ import annotations

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
HEADER = ['# Copyright 2026 lg_husky_sim contributors', '# SPDX-License-Identifier: Apache-2.0']
SOURCES = sorted(
    path
    for pattern in ('*.py', 'lg_husky_sim/**/*.py', 'test/**/*.py', 'benchmarks/**/*.py',
                    'scripts/*', 'launch/*.py', '.ci/run', 'run', 'check')
    for path in ROOT.glob(pattern)
    if path.suffix in {'.py', '.sh', ''} and path.is_file() and path.stat().st_size
)


@pytest.mark.parametrize('path', SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_file_begins_with_copyright_and_licence(path: Path) -> None:
    lines = path.read_text(encoding='utf-8').splitlines()
    while lines and lines[0].startswith(('#!', '# shellcheck')):
        lines = lines[1:]
    assert lines[:2] == HEADER


def test_licence_file_is_the_one_that_headers_name() -> None:
    text = (ROOT / 'LICENSE').read_text(encoding='utf-8')
    assert 'Apache License' in text
    assert 'Version 2.0, January 2004' in text
