# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""YAML as people write it: an error is one line, no duplicate keys, 1e-3 a number, 010 none."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
import os
from pathlib import Path
import re
from typing import Any

from lg_husky_sim.errors import LgHuskyError
import yaml

LARGEST = 4_000_000
"""Largest file that is read [bytes]."""

MOST_ALIASES = 100
"""A file with more references to anchors than this is refused: they can nest without end."""

MOST_NODES = 500_000
"""Most values and keys of a file, each reference counted as all that it refers to: 45 references
in a row, each to two of the one before, are more than any memory holds."""

LONGEST_NUMBER = 500
"""Longest text that is read as a number: 1:1:1:… in base 60 takes time with its square."""

DEEPEST = 50
"""Deepest nesting that is read; libyaml itself does not survive some ten thousand."""

_Base: Any = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)


class _Loader(_Base):  # type: ignore[misc]
    """The safe loader without its traps: duplicate keys, 1e-3 read as a text, 010 read as 8."""


def _unique_mapping(loader: Any, node: yaml.MappingNode) -> dict[Hashable, Any]:
    seen: set[str] = set()
    for key, _ in node.value:
        if isinstance(key, yaml.ScalarNode):
            if key.value in seen and key.value != '<<':
                raise yaml.constructor.ConstructorError(
                    None, None, f'{key.value} is given twice', key.start_mark)
            seen.add(key.value)
    loader.flatten_mapping(node)
    return yaml.constructor.BaseConstructor.construct_mapping(loader, node, deep=True)


_Loader.add_constructor('tag:yaml.org,2002:map', _unique_mapping)


def _short_number(kind: str) -> Callable[[Any, yaml.Node], object]:
    construct = _Base.yaml_constructors[f'tag:yaml.org,2002:{kind}']

    def number(loader: Any, node: yaml.Node) -> object:
        if len(node.value) > LONGEST_NUMBER:
            raise yaml.constructor.ConstructorError(
                None, None, f'a number of more than {LONGEST_NUMBER} characters', node.start_mark)
        if ':' in node.value or re.fullmatch(r'[-+]?0[0-7_]+', node.value):
            base = 60 if ':' in node.value else 8
            raise yaml.constructor.ConstructorError(
                None, None, f'{node.value} is a number of base {base} in YAML; '
                'write a decimal number, or put it in quotes', node.start_mark)
        value: object = construct(loader, node)
        return value
    return number


for _kind in ('int', 'float'):
    _Loader.add_constructor(f'tag:yaml.org,2002:{_kind}', _short_number(_kind))


class _Dumper(yaml.SafeDumper):
    """The safe dumper, which knows what this loader takes for a number: a name is no 1e5."""


# YAML 1.2's floats: PyYAML wants a dot and a sign in the exponent, as no engineer writes.
for _one in (_Loader, _Dumper):
    _one.add_implicit_resolver(
        'tag:yaml.org,2002:float', re.compile(r'^[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+$'),
        list('-+.0123456789'))


def yaml_text(data: object, flow: bool | None = False) -> str:
    """
    Return plain data as YAML that :func:`read_yaml` reads as the same.

    Parameters
    ----------
    data : object
        Mappings, lists, texts and numbers.
    flow : bool, optional
        As `default_flow_style` of PyYAML.

    Returns
    -------
    str

    """
    return str(yaml.dump(data, Dumper=_Dumper, sort_keys=False, allow_unicode=True,
                         default_flow_style=flow))


def brief(error: Exception) -> str:
    """Return an error's message with endless words cut, such as a value of a damaged file."""
    return re.sub(r'\S{120,}', lambda match: f'{match.group()[:57]}...', str(error))


def refuse_bombs(text: str, most: int = MOST_NODES) -> int:
    """
    Refuse what is deep, long or endless, by its events, before anything is made of it.

    Parameters
    ----------
    text : str
        YAML that this or another library is to read.
    most : int
        Values and keys that are allowed, each reference counted as all that it refers to.

    Returns
    -------
    int
        How many there are.

    Raises
    ------
    yaml.YAMLError
        In one line.

    """
    aliases = 0
    sizes: dict[str, int] = {}
    # Of what is open: anchor, and nodes so far; at the bottom, all of the file.
    inside: list[tuple[str | None, int]] = [(None, 0)]
    for event in yaml.parse(text, _Base):
        anchor, size = getattr(event, 'anchor', None), 1
        if isinstance(event, yaml.events.CollectionStartEvent):
            inside.append((anchor, 1))
            if anchor:
                sizes[anchor] = 0
            size = 0
        elif isinstance(event, yaml.events.CollectionEndEvent):
            anchor, size = inside.pop()
            if anchor:
                sizes[anchor] = size
        elif isinstance(event, yaml.events.AliasEvent):
            aliases += 1
            # libyaml itself refuses what is not defined, later.
            size = sizes.get(str(event.anchor), 1)
            if size == 0:
                raise yaml.YAMLError(f'{event.anchor} contains itself')
        elif anchor:
            sizes[anchor] = 1
        inside[-1] = inside[-1][0], inside[-1][1] + size
        if len(inside) - 1 > DEEPEST:
            raise yaml.YAMLError(f'nested deeper than {DEEPEST} levels')
        if aliases > MOST_ALIASES:
            raise yaml.YAMLError(f'more than {MOST_ALIASES} aliases')
        if inside[-1][1] > most:
            raise yaml.YAMLError(f'more than {most} values')
    return inside[0][1]


def shown(value: object) -> str:
    """Return a value as an error message shows it: in one line, cut where it is long."""
    text = repr(value)
    return text if len(text) <= 60 else f'{text[:57]}...'


def wrong_schema(content: Mapping[str, object], schema: str) -> str:
    """Return what is wrong with the schema of a file; '' if it is the one expected."""
    given = content.get('schema')
    if given is not None:
        return '' if given == schema else f'schema is {shown(given)}, expected {schema!r}'
    if 'elements' in content:
        return f'this is a linear graph, which only derive and lg.graph take; expected {schema!r}'
    return f'schema is missing, expected the line schema: {schema}'


def _reason(error: Exception) -> str:
    mark = getattr(error, 'problem_mark', None)
    if mark is None:
        return ' '.join(str(error).split())[:200]
    problem = ' '.join(str(getattr(error, 'problem', error)).split())[:200]
    return f'{problem} in line {mark.line + 1}, column {mark.column + 1}'


def parse_yaml(text: str) -> object:
    """
    Parse YAML text.

    Parameters
    ----------
    text : str
        Of a single document.

    Returns
    -------
    object
        Plain values as ``yaml.safe_load`` gives them.

    Raises
    ------
    ValueError
        It is no YAML, gives a key twice or nests without end; one line with the place.

    """
    try:
        refuse_bombs(text)
        return yaml.load(text, _Loader)  # noqa: S506 (a subclass of the safe loader)
    except (yaml.YAMLError, ValueError, TypeError, AttributeError, KeyError,
            OverflowError) as error:
        raise ValueError(f'not YAML: {_reason(error)}') from error


def read_yaml(path: str | os.PathLike[str], error: type[LgHuskyError]) -> dict[str, Any]:
    """
    Read a YAML file whose top is a mapping of names.

    Parameters
    ----------
    path : path-like
        A text file in UTF-8.
    error : type of LgHuskyError
        What to raise when it cannot be read.

    Returns
    -------
    dict
        Plain values as ``yaml.safe_load`` gives them.

    Raises
    ------
    LgHuskyError
        Of the given type: no such file, too large, not text, not YAML, a key twice, or no
        mapping; the message does not repeat the path.

    """
    place = Path(path)
    try:
        if place.stat().st_size > LARGEST:
            raise error(f'larger than {LARGEST} bytes')
        text = place.read_text(encoding='utf-8')
    except UnicodeDecodeError as cause:
        raise error('not a text file') from cause
    except OSError as cause:
        raise error(cause.strerror or str(cause)) from cause
    except ValueError as cause:  # a name that no file can have
        raise error(str(cause)) from cause
    try:
        data = parse_yaml(text)
    except ValueError as cause:
        raise error(str(cause)) from cause
    if not isinstance(data, dict) or not all(isinstance(key, str) for key in data):
        raise error('the file is not a mapping of names')
    return data
