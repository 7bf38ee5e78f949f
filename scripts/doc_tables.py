# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Write the tables of the docs from the code that they describe.

    python scripts/doc_tables.py          writes them between their markers
    python scripts/doc_tables.py --check  exits 1 if they are out of date
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
import re
import sys

DOCS = Path(__file__).resolve().parent.parent / 'docs'


def table(head: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """Return a Markdown table."""
    heading = list(head)
    lines: list[list[object]] = [[*heading], ['---'] * len(heading), *([*row] for row in rows)]
    return '\n'.join('| ' + ' | '.join(str(cell).replace('|', '\\|') for cell in line) + ' |'
                     for line in lines)


def verbs() -> str:
    """Return each verb of lg_husky with the first sentence of its help."""
    import click
    from lg_husky_sim.cli.main import cli
    context = click.Context(cli)
    rows = []
    for verb in cli.list_commands(context):
        command = cli.get_command(context, verb)
        rows.append((f'`{verb}`', command.get_short_help_str(200) if command else ''))
    return table(('verb', 'what it does'), rows)


def effects() -> str:
    """Return the catalogue: id, part, words, sides and forms, numbers with their units."""
    from lg_husky_sim.husky.effects import catalogue

    def words(names: Iterable[str]) -> str:
        return ', '.join(name for name in names if name not in ('', 'none'))
    return table(
        ('effect', 'part', 'what it is', 'sides', 'forms', 'numbers'),
        ((f'`{kind.id}`', kind.subsystem.value, kind.title, words(kind.sides),
          words(kind.shapes), ', '.join(f'`{p.name}` [{p.unit}]' for p in kind.parameters))
         for kind in catalogue().values()))


def parameters() -> str:
    """Return the physical parameters of the packaged Husky."""
    from lg_husky_sim.husky.model_file import load_model
    return table(
        ('parameter', 'value', 'unit', 'bounds', 'tolerance', 'source'),
        ((f'`{p.name}`', f'{p.value:g}', p.unit, f'{p.lower:g} to {p.upper:g}',
          f'{p.tolerance:g}', p.source) for p in load_model().parameters.entries))


def manoeuvres() -> str:
    """Return the built-in manoeuvres."""
    from lg_husky_sim.manoeuvres import builtin_manoeuvres
    return table(('manoeuvre', 'length [s]', 'what it is'), (
        (f'`{one.name}`', f'{one.duration:.1f}', one.about)
        for one in builtin_manoeuvres().values()))


def laws() -> str:
    """Return the named laws of a linear graph: formula, arguments, parameters, meaning."""
    from lg_husky_sim.linear_graph.laws import LAWS, listed
    return table(('law', 'formula', '`of`', '`parameters`', 'what it is'), (
        (f'`{name}`', f'`{law.expression}`', listed('z', law.arguments),
         listed('p', law.parameters), law.about) for name, law in LAWS.items()))


def rooms() -> str:
    """Return the packages of the diagnosis: purpose, modules, rounded lines."""
    import ast

    import lg_husky_sim.diagnosis
    root = Path(lg_husky_sim.diagnosis.__file__).parent
    rows = []
    for place in (*sorted(path.parent for path in root.glob('*/__init__.py')), root):
        modules = [path for path in place.glob('*.py') if path.name != '__init__.py']
        about = ast.get_docstring(ast.parse((place / '__init__.py').read_text('utf-8'))) or ''
        lines = sum(len(path.read_text('utf-8').splitlines()) for path in modules)
        rows.append((f'`{place.relative_to(root.parent)}`', about.partition('\n')[0],
                     len(modules), round(lines, -2)))
    return table(('package', 'question', 'modules', 'lines'), rows)


TABLES: Mapping[str, tuple[str, Callable[[], str]]] = {
    'verbs': ('command_line.md', verbs), 'effects': ('catalogue.md', effects),
    'parameters': ('catalogue.md', parameters), 'manoeuvres': ('catalogue.md', manoeuvres),
    'laws': ('linear_graph.md', laws), 'rooms': ('diagnosis.md', rooms)}


def filled(page: str, text: str) -> str:
    """Return the text of a page with each of its tables put between its markers."""
    for name, (place, make) in TABLES.items():
        if place != page:
            continue
        begin, end = f'<!-- table: {name} -->\n', f'\n<!-- end: {name} -->'
        pattern = re.compile(re.escape(begin) + '.*?' + re.escape(end), re.DOTALL)
        if len(pattern.findall(text)) != 1:
            raise ValueError(f'{page} must hold the markers of table {name} once')
        content = begin + make() + end
        text = pattern.sub(lambda _, content=content: content, text)  # type: ignore[misc]
    return text


def main() -> int:
    """Write the tables, or say whether they are up to date."""
    stale = 0
    for page in sorted({place for place, _ in TABLES.values()}):
        path = DOCS / page
        before = path.read_text(encoding='utf-8')
        after = filled(page, before)
        stale += before != after
        if '--check' not in sys.argv[1:]:
            path.write_text(after, encoding='utf-8')
    return int('--check' in sys.argv[1:] and stale > 0)


if __name__ == '__main__':
    sys.exit(main())
