# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A missing optional dependency is one line that says what to install."""

from __future__ import annotations

import ast
import importlib.util
from pathlib import Path
import re
import subprocess
import sys

from lg_husky_sim.errors import MissingExtraError
from lg_husky_sim.extras import EXTRA_OF, require
import pytest

ROOT = Path(__file__).resolve().parent.parent
#: What package.xml brings and pip does not.
ROS = set(re.findall(r'<exec_depend>(\w+)</exec_depend>',
                     (ROOT / 'package.xml').read_text(encoding='utf-8')))
WITHOUT = 'import sys\nsys.modules.update(dict.fromkeys({names}))\n'


def test_present_module_passes() -> None:
    require('numba', 'be quick')


def test_absent_module_names_extra_and_purpose(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr('lg_husky_sim.extras.find_spec', lambda name: None)
    with pytest.raises(MissingExtraError, match=(
            r'^rosbags is needed to read recordings and is not installed: '
            r"pip install rosbags, or in a clone pip install '\.\[bags\]'$")):
        require('rosbags', 'read recordings')


def test_each_module_belongs_to_an_extra_that_setup_offers() -> None:
    setup = (ROOT / 'setup.py').read_text(encoding='utf-8')
    for module, extra in EXTRA_OF.items():
        assert f"'{extra}': [" in setup, module


def test_each_import_is_required_or_belongs_to_an_extra() -> None:
    setup = (ROOT / 'setup.py').read_text(encoding='utf-8')
    required = set(re.findall(r"'([a-z]+)[>=<,.0-9]*'", setup.split('install_requires')[1]))
    # pytest itself loads the one module that needs it, the plugin with the fixtures.
    # MarkupSafe comes with Jinja2, and Pillow with matplotlib.
    known = {'yaml', 'lg_husky_sim', 'pytest', 'markupsafe', 'PIL', *required, *EXTRA_OF, *ROS,
             *sys.stdlib_module_names}
    found = set()
    for path in (ROOT / 'lg_husky_sim').rglob('*.py'):
        for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
            if isinstance(node, ast.Import):
                found |= {name.name.split('.')[0] for name in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                found.add(node.module.split('.')[0])
    assert found - known == set()
    # An extra that nothing imports is no extra, and each brings what it is named for.
    assert set(EXTRA_OF) - found <= {'dask'}
    for module, extra in EXTRA_OF.items():
        assert module == 'distributed' or module in setup.split(f"'{extra}': [")[1].split(']')[0]


def modules_below(part: str) -> list[str]:
    folder = ROOT / 'lg_husky_sim' / part
    return [f'lg_husky_sim.{part}.{path.stem}' for path in sorted(folder.glob('*.py'))
            if path.stem != '__init__']


@pytest.mark.parametrize('part', [
    path.parent.name for path in sorted((ROOT / 'lg_husky_sim').glob('*/__init__.py'))
    if path.parent.name not in {'ros', 'testing'}
])
def test_every_module_imports_without_the_extras(part: str) -> None:
    """Only the backends of the live node may need more than the core."""
    names = modules_below(part)
    assert names
    ask = WITHOUT.format(names=sorted(EXTRA_OF)) + '\n'.join(f'import {name}' for name in names)
    done = subprocess.run([sys.executable, '-c', ask], text=True, capture_output=True,
                          timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert importlib.util.find_spec(names[0]) is not None


def test_no_hint_asks_an_index_for_this_package() -> None:
    said = [path for folder in ('lg_husky_sim', 'docs') for path in (ROOT / folder).rglob('*')
            if path.suffix in ('.py', '.md')
            and re.search(r"install '?lg_husky_sim\[", path.read_text(encoding='utf-8'))]
    assert said == []


def test_the_extra_for_notebooks_brings_what_evaluate_needs() -> None:
    setup = (ROOT / 'setup.py').read_text(encoding='utf-8')
    listed = re.search(r"EXTRAS\['notebook'\] = .* in \(([^)]*)\)", setup)
    assert listed is not None
    assert "'search'" in listed[1]
