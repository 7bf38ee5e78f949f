# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The order in which processes of pytest-xdist get the tests."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.mark.parametrize('workers', [1, 2, 3, 5])
def test_each_process_begins_with_its_share_of_the_longest(
        request: pytest.FixtureRequest, workers: int) -> None:
    here: Any = next(one for one in request.config.pluginmanager.get_plugins()
                     if getattr(one, '__file__', None) == str(ROOT / 'test' / 'conftest.py'))
    seconds = {name: time for time, names in here.LONGEST for name in names}
    assert all(list((ROOT / 'test').rglob(name)) for name in seconds)
    items = [SimpleNamespace(path=Path(name)) for name in (
        *('test_a.py',) * 100, *seconds, *('test_z.py',) * 101, *seconds)]
    left = here.dealt(items, workers)
    assert sorted(map(id, left)) == sorted(map(id, items))
    together, loads = [], []
    for k in range(workers):
        share = len(left) // (workers - k)
        part, left = [one.path.name for one in left[:share]], left[share:]
        long = [name for name in part if name in seconds]
        assert part[:len(long)] == long
        together.append(set(long))
        loads.append(sum(time for time, names in here.LONGEST if names[0] in long))
    for _, names in here.LONGEST:
        assert sum(bool(set(names) & part) for part in together) == 1
    assert sum(loads) == sum(time for time, _ in here.LONGEST)
    assert max(loads) <= max(here.LONGEST[0][0], sum(loads) / workers + here.LONGEST[1][0])
