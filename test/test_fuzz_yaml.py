# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A thousand damaged YAML files: one line of refusal, or what the file says; never a crash."""

from __future__ import annotations

from collections.abc import Callable
import copy
from dataclasses import dataclass
import json
import math
from pathlib import Path
import random
import re
import time
from typing import Any

import jsonschema
from lg_husky_sim.cli.schema import schema_of
from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.linear_graph import compile_numeric
from lg_husky_sim.linear_graph.netlist import read_netlist
from lg_husky_sim.manoeuvres import load_manoeuvre
from lg_husky_sim.resources import config_path
from lg_husky_sim.yaml_files import parse_yaml
import pytest
import yaml

LONGEST = 2.0
"""No damaged file may take more computing time [s]."""

ODD_VALUES: tuple[Any, ...] = (
    None, True, -1, 0, 10 ** 400, -1e308, 1e-320, math.nan, math.inf, '', 'x' * 5000, '1.0',
    '\x00', [], {}, [1, 2], {'value': 1}, {1: 2}, 'é\n\n', '../../etc/passwd', '{', '-.inf',
    '12:30:45',
)

EFFECTS = """
effects:
- effect: yaw_scrub_coulomb
  parameters:
    yaw_coulomb_moment: {value: 1.5, unit: N·m, lower: 0.0, upper: 50.0, source: a fit}
- effect: battery_sag
"""

NETLIST = """name: DC motor
parameters:
  k_t: 0.05 N·m/A
elements:
  V_s: {is: voltage source, from: supply}
  R: {is: resistor, from: supply, to: winding, value: 0.5 ohm}
  L: {is: inductor, from: winding, to: motor, value: 2 mH}
  motor: {is: transformer, port 1: {domain: electrical, from: motor},
          port 2: {domain: rotational, from: shaft}, value: k_t}
  J: {is: inertia, from: shaft, value: 1e-3 kg·m²}
outputs: [omega(J), i(L)]
"""

SCRIPT = """schema: lg_husky_sim/commands/1
about: a left turn
rate: 20
steps:
  - {duration: 2.0, forward: 0.5, yaw: 0.0, ramp: 0.5}
  - {duration: 3.0, forward: 0.5, yaw: 0.4}
"""


@dataclass(frozen=True)
class Reader:
    """A reader, a sound file for it, and a look at what it read beside what the file says."""

    seed: Callable[[], str]
    read: Callable[[Path], Any]
    agrees: Callable[[Any, Any], None]
    count: int
    kind: str


def model_agrees(model: Any, data: Any) -> None:
    given = dict(data['parameters'])
    for effect in data.get('effects') or ():
        given |= effect.get('parameters') or {}
    for entry in model.parameters.entries:
        assert math.isfinite(entry.value)
        assert entry.lower <= entry.value <= entry.upper
        if entry.name in given:
            said = given[entry.name]
            assert entry.value == (said['value'] if isinstance(said, dict) else said)
    assert set(given) <= set(model.parameters)
    assert [effect.id for effect in model.structure.effects] == [
        effect['effect'] for effect in data.get('effects') or ()]


def script_agrees(manoeuvre: Any, data: Any) -> None:
    assert len(manoeuvre.steps) == len(data['steps'])
    for step, said in zip(manoeuvre.steps, data['steps'], strict=True):
        for name in ('duration', 'forward', 'yaw', 'ramp'):
            value = getattr(step, name)
            assert math.isfinite(value)
            assert value == said.get(name, 0.0)
    assert manoeuvre.rate == data.get('rate', manoeuvre.rate)


def read_and_derive(path: Path) -> Any:
    netlist = read_netlist(path)
    try:
        compile_numeric(netlist.graph, netlist.outputs).at(netlist.values)
    except LgHuskyError as error:
        # The file is a netlist, but of a graph that has no equations, or lacks numbers.
        raise type(error)(f'{path}: {error}') from error
    return netlist


def netlist_agrees(netlist: Any, data: Any) -> None:
    names = {element.name for element in (*netlist.graph.branches, *netlist.graph.two_ports)}
    assert names == set(data['elements'])
    assert netlist.outputs == tuple(data.get('outputs') or netlist.outputs)
    assert all(math.isfinite(value) for value in netlist.values.values())
    # 2 mH is 0.002 H, whatever else was damaged.
    inductor = data['elements'].get('L')
    if inductor and inductor.get('value') == '2 mH':
        assert netlist.values['L'] == pytest.approx(0.002)


READERS = {
    'parameters': Reader(lambda: config_path('husky.yaml').read_text(encoding='utf-8'),
                         load_model, model_agrees, 300, 'model'),
    'model with effects': Reader(
        lambda: config_path('husky.yaml').read_text(encoding='utf-8').replace(
            '\neffects: []', '') + EFFECTS,
        load_model, model_agrees, 350, 'model'),
    'command script': Reader(lambda: SCRIPT, load_manoeuvre, script_agrees, 350,
                             'commands'),
    'netlist': Reader(lambda: NETLIST, read_and_derive, netlist_agrees, 350, 'graph'),
}


def places(data: Any) -> list[tuple[Any, Any]]:
    """List every (container, key) of a tree."""
    found: list[tuple[Any, Any]] = []
    keys = list(data) if isinstance(data, dict) else range(len(data)) if isinstance(
        data, list) else ()
    for key in keys:
        found += [(data, key), *places(data[key])]
    return found


def damaged_tree(text: str, dice: random.Random) -> str:
    """Put odd values, strange names and gaps into the tree; return it as YAML."""
    data = copy.deepcopy(yaml.safe_load(text))
    for _ in range(dice.choice((1, 1, 1, 3))):
        container, key = dice.choice(places(data))
        match dice.randrange(4):
            case 0:
                del container[key]
            case 1 if isinstance(container, dict):
                container[dice.choice(('x', 7, 'valeu', 'mass ', True))] = container.pop(key)
            case _:
                container[key] = dice.choice(ODD_VALUES)
        if not places(data):
            break
    return yaml.safe_dump(data, allow_unicode=True, sort_keys=dice.random() < 0.5)


def damaged_bytes(text: str, dice: random.Random) -> bytes:
    """Flip, cut, double and insert bytes."""
    raw = bytearray(text.encode())
    for _ in range(dice.choice((1, 2, 8))):
        at = dice.randrange(len(raw))
        match dice.randrange(5):
            case 0:
                raw[at] ^= 1 << dice.randrange(8)
            case 1:
                del raw[at:at + dice.randrange(1, 40)]
            case 2:
                raw[at:at] = raw[at:at + dice.randrange(1, 200)]
            case 3:
                raw[at:at] = dice.choice((b'\t', b': ', b'- ', b'&a ', b'*a', b'!!', b'\x00', b'"',
                                          b'e999', b'\xff', b'{', b'? ', b'#', b'|', b'\r'))
            case _:
                del raw[at:]
                raw += b' '
    return bytes(raw)


@pytest.mark.parametrize('name', READERS)
def test_damaged_files_are_refused_in_one_line_or_read_as_they_stand(
        name: str, tmp_path: Path) -> None:
    reader = READERS[name]
    editor = jsonschema.Draft7Validator(schema_of(reader.kind))
    seed = reader.seed()
    sound = tmp_path / 'sound.yaml'
    sound.write_text(seed, encoding='utf-8')
    reader.agrees(reader.read(sound), parse_yaml(seed))
    dice = random.Random(f'fuzz {name}')
    outcomes = {'refused': 0, 'read': 0}
    for number in range(reader.count):
        path = tmp_path / 'damaged.yaml'
        if number % 2:
            path.write_bytes(damaged_bytes(seed, dice))
        else:
            path.write_text(damaged_tree(seed, dice), encoding='utf-8')
        began = time.process_time()
        try:
            value = reader.read(path)
        except LgHuskyError as error:
            outcomes['refused'] += 1
            message = str(error)
            assert message.startswith(f'{path}: '), (number, message)
            head, *lines = message.split('\n  ')
            assert not lines or head == f'{path}: {len(lines)} errors', (number, message)
            for line in (head, *lines):
                assert '\n' not in line, (number, message)
                assert len(line) < len(str(path)) + 1500, (number, message)
            assert not re.search(r'<.*object at 0x|Traceback', message), (number, message)
        except Exception as error:
            pytest.fail(f'file {number}: {type(error).__name__}: {error}\n'
                        f'{path.read_bytes()!r}'[:3000])
        else:
            outcomes['read'] += 1
            said = parse_yaml(path.read_text(encoding='utf-8'))
            reader.agrees(value, said)
            # An editor with the schema marks nothing of it; JSON has no dates, only texts.
            assert list(editor.iter_errors(json.loads(json.dumps(said, default=str)))) == []
        assert time.process_time() - began < LONGEST
    assert outcomes['refused'] > reader.count / 4, outcomes
    # Some survive (a changed comment, a value within its bounds), so that agreement is seen too.
    assert outcomes['read'] >= 5, outcomes


def test_there_are_a_thousand_of_them() -> None:
    assert sum(reader.count for reader in READERS.values()) >= 1000
