# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The --ros-args part of a command line, and names expanded and remapped by it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
import re
from typing import Any

from lg_husky_sim.errors import SettingsError
from lg_husky_sim.yaml_files import parse_yaml, read_yaml

_TOKEN = re.compile(r'^[A-Za-z_][A-Za-z0-9_]*$')
_FLAGS = {'--enable-rosout-logs', '--disable-rosout-logs', '--enable-stdout-logs',
          '--disable-stdout-logs', '--enable-external-lib-logs', '--disable-external-lib-logs'}
_TAKING = {'-r', '--remap', '-p', '--param', '--params-file', '--log-level', '--log-config-file',
           '-e', '--enclave'}


@dataclass(frozen=True)
class Rule:
    """A remapping, or a parameter, that holds for all nodes or for one."""

    node: str | None
    name: str
    value: Any


@dataclass(frozen=True)
class Arguments:
    """What the command line says."""

    remaps: tuple[Rule, ...] = ()
    parameters: tuple[Rule, ...] = ()
    log_level: str = 'info'
    rest: tuple[str, ...] = field(default=())


def _split(text: str, option: str) -> tuple[str | None, str, str]:
    left, mark, right = text.partition(':=')
    if not mark or not left:
        raise SettingsError(f'{option} {text!r} is not of the form name:=value')
    node, colon, name = left.rpartition(':')
    return (node if colon else None), name, right


def _flatten(values: Mapping[str, Any], prefix: str = '') -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in values.items():
        if isinstance(value, Mapping):
            flat |= _flatten(value, f'{prefix}{key}.')
        else:
            flat[f'{prefix}{key}'] = value
    return flat


def _read_file(path: str) -> list[Rule]:
    rules: list[Rule] = []
    try:
        content = read_yaml(path, SettingsError)
    except SettingsError as error:
        raise SettingsError(f'parameter file {path}: {error}') from error

    def walk(values: Mapping[Any, Any], above: str) -> None:
        for key, value in values.items():
            if not isinstance(value, Mapping):
                raise SettingsError(
                    f'parameter file {path}: {above}{key} has no ros__parameters below it')
            if key == 'ros__parameters':
                rules.extend(Rule(above.rstrip('/') or '/**', name, one)
                             for name, one in _flatten(value).items())
            else:
                walk(value, f'{above}{str(key).strip("/")}/' if above
                     else f'{str(key).rstrip("/")}/')

    walk(content, '')
    return rules


def parse(args: Sequence[str]) -> Arguments:
    """
    Read the --ros-args sections of a command line.

    Parameters
    ----------
    args : sequence of str
        With the program's name first, or without.

    Returns
    -------
    Arguments
        ``rest`` holds what is outside the sections.

    Raises
    ------
    SettingsError
        If an option is unknown or incomplete, or a file cannot be read.

    """
    remaps: list[Rule] = []
    parameters: list[Rule] = []
    rest: list[str] = []
    level, inside, place = 'info', False, 0
    while place < len(args):
        word = args[place]
        place += 1
        if not inside:
            inside = word == '--ros-args'
            if not inside:
                rest.append(word)
        elif word == '--':
            inside = False
        elif word in _FLAGS or word == '--ros-args':
            continue
        elif word in _TAKING:
            if place == len(args):
                raise SettingsError(f'{word} needs a value after it')
            value = args[place]
            place += 1
            if word in ('-r', '--remap'):
                remaps.append(Rule(*_split(value, word)))
            elif word in ('-p', '--param'):
                node, name, text = _split(value, word)
                try:
                    parameters.append(Rule(node, name, parse_yaml(text)))
                except ValueError as error:
                    raise SettingsError(f'-p {value!r}: {error}') from error
            elif word == '--params-file':
                parameters.extend(_read_file(value))
            elif word == '--log-level':
                level = value.rpartition(':=')[2].lower()
        else:
            raise SettingsError(f'unknown ROS argument {word!r}; there are '
                                f'{", ".join(sorted(_TAKING | _FLAGS))}')
    return Arguments(tuple(remaps), tuple(parameters), level, tuple(rest))


def _matches(pattern: str | None, namespace: str, node: str) -> bool:
    if pattern is None:
        return True
    full = f'{namespace.rstrip("/")}/{node}'
    if '*' not in pattern:
        return pattern in (node, full) or f'/{pattern}' == full
    expression = re.escape(pattern if pattern.startswith('/') else f'/{pattern}')
    expression = expression.replace(r'/\*\*', '(/.*)?').replace(r'\*', '[^/]*')
    return re.fullmatch(expression, full) is not None


@dataclass(frozen=True)
class NodeNames:
    """
    A node's own name, and how it turns names into full ones.

    Parameters
    ----------
    name, namespace : str
        After ``__node`` and ``__ns``.
    arguments : Arguments

    """

    name: str
    namespace: str
    arguments: Arguments

    @classmethod
    def resolve(cls, name: str, namespace: str, arguments: Arguments) -> NodeNames:
        """
        Apply ``__node`` and ``__ns`` and check both names.

        Raises
        ------
        SettingsError
            If a name has characters that ROS does not allow.

        """
        own = name
        # The first rule counts, as in rcl.
        for rule in reversed(arguments.remaps):
            if rule.node in (None, own):
                if rule.name in ('__node', '__name'):
                    name = str(rule.value)
                elif rule.name == '__ns':
                    namespace = str(rule.value)
        namespace = '/' + namespace.strip('/')
        parts = namespace.strip('/').split('/') if namespace != '/' else []
        for kind, given, tokens in (('name', name, [name]), ('namespace', namespace, parts)):
            if not all(map(_TOKEN.match, tokens)):
                raise SettingsError(
                    f'{kind} {given!r}: each part may hold letters, digits and underscores only, '
                    'and may neither be empty nor begin with a digit')
        return cls(name, namespace, arguments)

    @property
    def full(self) -> str:
        """Namespace and name."""
        return f'{self.namespace.rstrip("/")}/{self.name}'

    def _expand(self, name: str) -> str:
        if name.startswith('/'):
            return name
        if name == '~' or name.startswith('~/'):
            return self.full + name[1:]
        return f'{self.namespace.rstrip("/")}/{name}'

    def expand(self, name: str) -> str:
        """
        Return the full name of a topic or service after remapping.

        Raises
        ------
        SettingsError
            If the name is no ROS name.

        """
        full = self._expand(name)
        for rule in self.arguments.remaps:
            if not rule.name.startswith('__') and _matches(rule.node, self.namespace, self.name):
                pattern = rule.name.removeprefix('rostopic://').removeprefix('rosservice://')
                if self._expand(pattern) == full:
                    full = self._expand(str(rule.value))
                    break
        if not all(_TOKEN.match(part) for part in full[1:].split('/')):
            raise SettingsError(
                f'topic or service name {full!r} is not valid: parts hold letters, digits and '
                'underscores only, and do not begin with a digit')
        return full

    def parameters(self) -> dict[str, Any]:
        """Return the parameters given for this node; later ones win."""
        return {rule.name: rule.value for rule in self.arguments.parameters
                if _matches(rule.node, self.namespace, self.name)}
