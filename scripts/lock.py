# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Print the installed versions of what the project needs, one `name==version` a line.

    .venv/bin/python scripts/lock.py > requirements.lock

Names and versions only: where packages come from is the installing machine's business.
"""

from __future__ import annotations

from collections.abc import Iterable
from importlib.metadata import distribution, PackageNotFoundError, requires
from pathlib import Path
import runpy
import sys
from typing import Any
from unittest import mock

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

SETUP = Path(__file__).resolve().parent.parent / 'setup.py'
EXTRA = 'check'


def project_needs() -> list[str]:
    """Return what setup.py asks for, the extra included."""
    said: dict[str, Any] = {}
    with mock.patch('setuptools.setup', side_effect=lambda **given: said.update(given)):
        runpy.run_path(str(SETUP))
    return [*said['install_requires'], *said['extras_require'][EXTRA]]


def collect(texts: Iterable[str], extras: frozenset[str], found: dict[str, str],
            seen: set[tuple[str, frozenset[str]]]) -> None:
    """Add the versions of all that requirements need, and of what that needs."""
    for text in texts:
        need = Requirement(text)
        if need.marker is not None and not any(
                need.marker.evaluate({'extra': extra}) for extra in (*extras, '')):
            continue
        name, own = canonicalize_name(need.name), frozenset(need.extras)
        try:
            found[name] = distribution(name).version
        except PackageNotFoundError:
            print(f'{name} is not installed', file=sys.stderr)
            continue
        if (name, own) not in seen:
            seen.add((name, own))
            collect(requires(name) or [], own, found, seen)


def main() -> int:
    """Print the lock file."""
    found: dict[str, str] = {}
    collect(project_needs(), frozenset(), found, set())
    print(f'# Python {sys.version_info.major}.{sys.version_info.minor}, the extra {EXTRA}; '
          'written by scripts/lock.sh')
    for name in sorted(found):
        print(f'{name}=={found[name]}')
    return 0


if __name__ == '__main__':
    sys.exit(main())
