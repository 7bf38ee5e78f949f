# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The shared YAML reader: its two repaired traps and each way of refusing."""

from __future__ import annotations

import datetime
from pathlib import Path
import time

from lg_husky_sim.errors import CommandError
from lg_husky_sim.yaml_files import LARGEST, parse_yaml, read_yaml
import pytest


@pytest.mark.parametrize(('text', 'value'), [
    ('1e-3', 0.001), ('2E5', 2e5), ('-1.5e3', -1500.0), ('.5e1', 5.0), ('1e+3', 1000.0),
    ('12', 12), ('1.5', 1.5), ('true', True), ('e3', 'e3'), ('1e', '1e'), ('0x10', 16),
    ('2026-01-01', datetime.date(2026, 1, 1)),
])
def test_scalars_are_what_people_mean(text: str, value: object) -> None:
    parsed = parse_yaml(f'x: {text}')
    assert parsed == {'x': value}
    assert isinstance(parsed, dict)
    assert type(parsed['x']) is type(value)


@pytest.mark.parametrize(('text', 'message'), [
    ('a: 1\nb: 2\na: 3', r'^not YAML: a is given twice in line 3, column 1$'),
    ('p: {mass: 1, mass: 2}', r'^not YAML: mass is given twice in line 1, column 14$'),
    ('a: [1, 2', r'^not YAML: .* in line \d, column \d$'),
    ('!!python/object:os.system {}', r'^not YAML: could not determine a constructor'),
    ('[' * 900, '^not YAML: nested deeper than 50 levels$'),
    # PyYAML 6.0.4 refuses by itself what is deeper than 1000.
    ('[' * 100_000, '^not YAML: (nested deeper than 50 levels$|exceeded maximum nesting depth)'),
    ('[*b]', r'^not YAML: found undefined alias'),
    ('a: &a [1, {b: *a}]', '^not YAML: a contains itself$'),
    (f'a: {":".join(["1"] * 200)}.5', r'^not YAML: 1:1:.* in line 1, column 4$'),
    ('a: 1:30', '^not YAML: 1:30 is a number of base 60 in YAML; write a decimal number, or put '
     'it in quotes in line 1, column 4$'),
    ('a: 010', '^not YAML: 010 is a number of base 8 in YAML; write a decimal number'),
    (f'a: {":".join(["1"] * 1_900_000)}', '^not YAML: a number of more than 500 characters in '),
    (f'a: 0x{"f" * 501}', '^not YAML: a number of more than 500 characters in line 1, column 4$'),
    (f'a: !{"x" * 3_000_000} 1', '^not YAML: could not determine a constructor'),
    ('? {a: 1}\n: 2', 'not YAML: '),
    ('x: 2026-99-99', 'not YAML: month must be in 1..12'),
])
def test_what_is_refused(text: str, message: str) -> None:
    start = time.process_time()
    with pytest.raises(ValueError, match=message) as caught:
        parse_yaml(text)
    assert time.process_time() - start < 5.0
    assert '\n' not in str(caught.value)
    assert len(str(caught.value)) < 300


def test_nested_aliases_are_refused_at_once() -> None:
    rows = ['a0: &a0 [x, x, x, x, x, x, x, x, x, x]']
    rows += [f'a{i}: &a{i} [{", ".join(["*a" + str(i - 1)] * 10)}]' for i in range(1, 40)]
    start = time.process_time()
    with pytest.raises(ValueError, match='more than 500000 values'):
        parse_yaml('\n'.join(rows))
    with pytest.raises(ValueError, match='more than 100 aliases'):
        parse_yaml(f'a: &a 1\nb: [{", ".join(["*a"] * 101)}]')
    assert time.process_time() - start < 2.0


@pytest.mark.parametrize('entry', ['[*a{0}, *a{0}]', '{{p: *a{0}, q: *a{0}}}'])
def test_references_that_double_are_refused(entry: str) -> None:
    """Read, they share what they hold; shown or copied, 45 of them never end."""
    rows = ['a0: &a0 [x, x]']
    rows += [f'a{i}: &a{i} {entry.format(i - 1)}' for i in range(1, 45)]
    parse_yaml('\n'.join(rows[:10]))
    with pytest.raises(ValueError, match='more than 500000 values'):
        parse_yaml('\n'.join(rows))


def test_merge_keys_still_work() -> None:
    assert parse_yaml('a: &a {x: 1, y: 2}\nb: {<<: *a, y: 3}') == {
        'a': {'x': 1, 'y': 2}, 'b': {'x': 1, 'y': 3}}


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    path = tmp_path / 'script.yaml'
    for content, message in (
            (b'\xff\xfe\x00', 'not a text file'),
            (b'- 1\n', 'the file is not a mapping of names'),
            (b'1: 2\n', 'the file is not a mapping of names'),
            (b'', 'the file is not a mapping of names'),
            (b' ' * (LARGEST + 1), f'larger than {LARGEST} bytes')):
        path.write_bytes(content)
        with pytest.raises(CommandError, match=message):
            read_yaml(path, CommandError)
    with pytest.raises(CommandError, match='No such file'):
        read_yaml(tmp_path / 'absent.yaml', CommandError)
    with pytest.raises(CommandError, match='Is a directory'):
        read_yaml(tmp_path, CommandError)
    with pytest.raises(CommandError, match='null byte'):
        read_yaml('no\0file.yaml', CommandError)
