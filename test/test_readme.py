# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What README and docs say: tables made from the code, commands, links, and tests that exist."""

from __future__ import annotations

import ast
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
import re
import shlex
from types import ModuleType

import click
from lg_husky_sim.cli.main import cli
from lg_husky_sim.cli.ros_arguments import RosVerb, split_ros_args
from lg_husky_sim.diagnosis.settings import setting
import pytest

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / 'README.md', *sorted((ROOT / 'docs').rglob('*.md'))]
MORE = [ROOT / 'CONTRIBUTING.md', ROOT / 'CHANGELOG.md']


def page_id(path: Path) -> str:
    return str(path.relative_to(ROOT))


def doc_tables() -> ModuleType:
    spec = spec_from_file_location('doc_tables', ROOT / 'scripts' / 'doc_tables.py')
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize('page', ['catalogue.md', 'command_line.md', 'linear_graph.md'])
def test_tables_are_those_of_the_code(page: str) -> None:
    text = (ROOT / 'docs' / page).read_text(encoding='utf-8')
    assert doc_tables().filled(page, text) == text, 'run: python scripts/doc_tables.py'


def test_tables_that_differ_are_seen() -> None:
    text = (ROOT / 'docs' / 'catalogue.md').read_text(encoding='utf-8')
    changed = text.replace('| `mass` | 48.39 |', '| `mass` | 60 |')
    assert changed != text
    assert doc_tables().filled('catalogue.md', changed) == text


def test_the_readme_stays_short() -> None:
    assert len((ROOT / 'README.md').read_text(encoding='utf-8').splitlines()) < 120


@pytest.mark.parametrize('page', ['README.md', 'docs/diagnosis.md'])
def test_the_nominal_rate_of_false_alarms_is_that_of_the_settings(page: str) -> None:
    rate = 100.0 * setting('false_alarm_rate')
    assert f'nominal false-alarm rate of {rate:g} %' in (ROOT / page).read_text(encoding='utf-8')


def test_each_page_stands_in_the_site() -> None:
    """`mkdocs build --strict` in ./check sees dead links; this, forgotten pages."""
    site = (ROOT / 'mkdocs.yml').read_text(encoding='utf-8')
    for page in PAGES[1:]:
        assert f': {page.relative_to(ROOT / "docs").as_posix()}' in site


def blocks(text: str) -> list[str]:
    """Return the lines of code blocks, fenced or indented, continuation lines joined."""
    fenced = re.findall(r'^```(?:bash|sh|console)?\n(.*?)^```', text, re.DOTALL | re.MULTILINE)
    indented = re.findall(r'(?:^ {4}.+\n)+', text, re.MULTILINE)
    lines = '\n'.join(fenced + indented).replace('\\\n', ' ').splitlines()
    return [line.strip().removeprefix('$ ') for line in lines]


def commands(text: str) -> list[list[str]]:
    """Return the arguments of each `lg_husky` or `./run` command in code blocks."""
    found = []
    for line in blocks(text):
        match = re.match(r'(?:time )?(?:\./run|lg_husky)\b(.*)', line)
        if match:
            words = shlex.split(match.group(1), comments=True)
            found.append([word for word in words if word not in {'&', '|', '>'}])
    return found


def complaint(arguments: list[str]) -> str:
    """Say what is wrong with a command of lg_husky, without running it; empty if nothing."""
    if not arguments or arguments[0] in {'sim_node', 'python', '-h', '--help', '--version'}:
        return ''
    context = click.Context(cli)
    verb, *rest = arguments
    command = cli.get_command(context, verb)
    if command is None:
        return f'{verb} is not a verb'
    known = {opt for parameter in command.params
             for opt in (*parameter.opts, *parameter.secondary_opts)} | {'-h', '--help'}
    if isinstance(command, click.Group):
        return '' if not rest or rest[0] in command.commands else f'{rest[0]} is no {verb}'
    if isinstance(command, RosVerb):
        rest, _ = split_ros_args(rest)
    for word in rest:
        option = word.partition('=')[0]
        if re.match(r'--?[a-z]', option) and option not in known:
            return f'{verb} has no option {option}'
    return ''


def test_wrong_commands_are_seen() -> None:
    assert complaint(['compar', 'x']) == 'compar is not a verb'
    assert complaint(['compare', 'x', '--oot', 'y']) == 'compare has no option --oot'
    assert commands('    ./run compare REC --out DIR  # a note\n') == [
        ['compare', 'REC', '--out', 'DIR']]


@pytest.mark.parametrize('page', PAGES, ids=page_id)
def test_commands_on_the_page_exist(page: Path) -> None:
    text = page.read_text(encoding='utf-8')
    problems = {' '.join(arguments): complaint(arguments) for arguments in commands(text)}
    assert {line: problem for line, problem in problems.items() if problem} == {}


@pytest.mark.parametrize('page', [*PAGES, *MORE], ids=page_id)
def test_links_and_pictures_on_the_page_exist(page: Path) -> None:
    text = page.read_text(encoding='utf-8')
    targets = re.findall(r'\]\(([^)\s]+)\)', re.sub(r'```.*?```', '', text, flags=re.DOTALL))
    missing = []
    for target in targets:
        if target.startswith(('http:', 'https:')):
            continue
        name, _, anchor = target.partition('#')
        path = (page.parent / name).resolve() if name else page
        if not path.exists():
            missing.append(target)
        elif anchor and path.suffix == '.md':
            heads = re.findall(r'^#+ (.+)$', path.read_text(encoding='utf-8'), re.MULTILINE)
            slugs = {re.sub(r'[^\w\- ]', '', head.lower()).replace(' ', '-') for head in heads}
            if anchor not in slugs:
                missing.append(target)
    assert missing == []


def test_each_test_that_a_page_names_exists() -> None:
    """Pages name tests as `file.py::test_name`."""
    named = 0
    for page in PAGES:
        for place, name in re.findall(r'([\w/]+\.py)::(\w+)', page.read_text(encoding='utf-8')):
            named += 1
            path = ROOT / 'test' / place.removeprefix('test/')
            assert path.is_file(), f'{page.name} names {place}'
            functions = {node.name for node in ast.walk(ast.parse(path.read_text('utf-8')))
                         if isinstance(node, ast.FunctionDef)}
            assert name in functions, f'{page.name} names {place}::{name}'
    assert named >= 13


def test_every_page_is_reached_from_the_index() -> None:
    index = (ROOT / 'docs' / 'README.md').read_text(encoding='utf-8')
    linked = set(re.findall(r'\]\(([^)#\s]+)', index))
    pages = {page.relative_to(ROOT / 'docs').as_posix() for page in PAGES
             if page.parent == ROOT / 'docs' and page.name != 'README.md'}
    assert pages <= linked, f'docs/README.md does not mention {sorted(pages - linked)}'
    assert 'docs/README.md' in (ROOT / 'README.md').read_text(encoding='utf-8')
