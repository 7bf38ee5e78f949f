# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The parts import downwards only, big libraries have one owner, and files stay short."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / 'lg_husky_sim'
MAX_LINES = 400

BASE = {'blas', 'errors', 'extras', 'folders', 'heap', 'jit', 'manoeuvres', 'parallel',
        'resources', 'settings', 'signals', 'threads', 'yaml_files'}
MODEL = {'linear_graph', 'husky', 'simulation'}
DATA = MODEL | {'recording', 'comparison', 'reporting'}
MAY_IMPORT: dict[str, set[str]] = {
    'errors': set(),
    'signals': {'errors', 'extras'},
    'resources': {'errors'},
    'extras': {'errors'},
    'folders': {'errors'},
    'yaml_files': {'errors'},
    'settings': {'errors', 'resources', 'yaml_files'},
    'blas': set(),
    'heap': set(),
    'threads': {'blas', 'heap'},
    'jit': {'errors', 'extras'},
    'parallel': {'errors', 'extras'},
    'manoeuvres': {'errors', 'signals', 'resources', 'yaml_files'},
    'linear_graph': set(),
    'husky': {'linear_graph'},
    'simulation': {'linear_graph', 'husky'},
    'recording': set(),
    'reporting': set(),
    'comparison': MODEL | {'recording', 'reporting'},
    'identification': DATA,
    'diagnosis': DATA | {'identification'},
    'proof': DATA | {'identification', 'diagnosis'},
    'evaluation': DATA | {'identification', 'diagnosis', 'proof'},
    'ros': MODEL,
    'testing': MODEL | {'ros'},
    'api': DATA | {'identification', 'diagnosis'},
    '__init__': {'api'},
}
"""What each part may import besides itself and the base; cli may import everything."""

OWNERS = {
    'sympy': {'linear_graph'},
    'rclpy': {'ros'},
    'cyclonedds': {'ros'},
    'rosbags': {'recording', 'ros', 'proof'},
}
"""Library to the parts that may import it; ros takes message definitions from
rosbags, and proof writes bags with code of its own, as the blind trial shares none."""

ONLY_INSIDE_FUNCTIONS = {'sympy', 'matplotlib', 'mujoco', 'pybullet', 'dask', 'distributed',
                         'rosbags', 'cyclonedds', 'jinja2', 'pandas', 'control', 'plotly',
                         'PIL', 'threadpoolctl', 'joblib', 'ray'}
"""Slow to import or optional: the package imports without them. The
backends of ros are chosen at run time, each in files of its own that import what they need."""


def imports_of(source: str) -> Iterator[tuple[str, bool]]:
    """Yield each imported module's full name, and whether importing the file imports it."""
    tree = ast.parse(source)
    inside: set[ast.AST] = set()
    for node in ast.walk(tree):
        lazy = isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)) or (
            isinstance(node, ast.If) and 'TYPE_CHECKING' in ast.unparse(node.test))
        if lazy:
            inside.update(ast.walk(node))
    for node in ast.walk(tree):
        match node:
            case ast.Import(names=names):
                for name in names:
                    yield name.name, node not in inside
            case ast.ImportFrom(module=str(module), level=0, names=names):
                yield module, node not in inside
                if module == 'lg_husky_sim':
                    for name in names:
                        yield f'{module}.{name.name}', node not in inside
            case ast.ImportFrom(level=level) if level:
                message = f'relative import in line {node.lineno}'
                raise AssertionError(message)


def part_of(path: Path) -> str:
    """Return the part a file of the package belongs to: a folder, or a module at the top."""
    return path.relative_to(PACKAGE).parts[0].removesuffix('.py')


def violations(part: str, source: str) -> list[str]:
    """List the imports of a file of that part that point up or take another part's library."""
    found = []
    allowed = MAY_IMPORT.get(part, set()) | {part} | (set() if part in BASE else BASE)
    for name, at_import in imports_of(source):
        top, _, rest = name.partition('.')
        target = rest.partition('.')[0]
        if top == 'lg_husky_sim' and target and part != 'cli' and target not in allowed:
            found.append(f'{part} may not import {target}')
        if top in OWNERS and part not in OWNERS[top]:
            found.append(f'{part} does not own {top}')
        if top in ONLY_INSIDE_FUNCTIONS and at_import and part != 'ros':
            found.append(f'{top} is imported with the file, not inside a function')
    return found


FILES = sorted(PACKAGE.rglob('*.py'))


def test_the_rule_sees_what_it_forbids() -> None:
    assert violations('husky', 'from lg_husky_sim.simulation import rollout') == [
        'husky may not import simulation']
    assert violations('recording', 'def f():\n    from lg_husky_sim import husky') == [
        'recording may not import husky']
    assert violations('husky', 'def f():\n    import sympy') == ['husky does not own sympy']
    assert violations('linear_graph', 'import sympy as sp') == [
        'sympy is imported with the file, not inside a function']
    assert violations('simulation', 'from lg_husky_sim.husky.model import Plant') == []
    with pytest.raises(AssertionError, match='relative import'):
        violations('husky', 'from . import model')


@pytest.mark.parametrize('path', FILES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_point_down(path: Path) -> None:
    part = part_of(path)
    assert part in {*MAY_IMPORT, 'cli'}, \
        f'{part} is a new part: say in MAY_IMPORT what it may import'
    assert violations(part, path.read_text(encoding='utf-8')) == []


def test_the_table_of_layers_has_no_cycle() -> None:
    def reach(part: str, seen: tuple[str, ...] = ()) -> None:
        assert part not in seen, ' -> '.join((*seen, part))
        for below in MAY_IMPORT[part]:
            reach(below, (*seen, part))
    for part in MAY_IMPORT:
        reach(part)


def test_files_stay_short() -> None:
    python = [*FILES, *(ROOT / 'test').rglob('*.py'), *(ROOT / 'benchmarks').rglob('*.py')]
    lines = {path: len(path.read_text(encoding='utf-8').splitlines()) for path in python}
    too_long = {str(path.relative_to(ROOT)): count for path, count in lines.items()
                if count > MAX_LINES}
    assert too_long == {}
