# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Print the closing line of ./check from pytest's JUnit reports: N passed, N failed, N skipped."""

from __future__ import annotations

from pathlib import Path
import sys
from xml.etree import ElementTree


def closing_line(reports: list[Path], failed_steps: int) -> str:
    """Count the tests of JUnit reports; without any, the failed steps are all there is."""
    suites = [suite for report in reports
              for suite in ElementTree.parse(report).iter('testsuite')]  # noqa: S314 (our own)
    total, bad, skipped = (
        sum(int(suite.get(key, 0)) for key in keys for suite in suites)
        for keys in (('tests',), ('failures', 'errors'), ('skipped',))
    )
    # A linter that failed is no test, but the line must not read as if all were well.
    failed = bad if bad else failed_steps
    return f'{total - bad - skipped} passed, {failed} failed, {skipped} skipped'


if __name__ == '__main__':
    print(closing_line(sorted(Path(sys.argv[1]).glob('*.xml')), int(sys.argv[2])))
