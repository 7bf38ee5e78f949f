# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""JSON schemas for editors: shipped files fit, and nothing that a reader accepts is marked."""

from __future__ import annotations

from collections.abc import Callable
import json
import math
from pathlib import Path
import re
from typing import Any

from click.testing import CliRunner
import jsonschema
from lg_husky_sim.cli.main import cli
from lg_husky_sim.cli.schema import FILES, schema_of
from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.husky.effects import catalogue, Effect
from lg_husky_sim.husky.model import Structure
from lg_husky_sim.husky.model_file import load_model, model_data, model_from_data, ModelFile
from lg_husky_sim.husky.model_schema import SCHEMA as MODEL
from lg_husky_sim.linear_graph.netlist import read_netlist
from lg_husky_sim.manoeuvres import load_manoeuvre, SCHEMA
from lg_husky_sim.ros.settings import make_settings, TABLE
from lg_husky_sim.yaml_files import parse_yaml, yaml_text
import pytest

ROOT = Path(__file__).resolve().parent.parent
NETLIST = """name: DC motor
parameters:
  k_t: 0.05 N·m/A
elements:
  V_s: {is: voltage source, from: supply}
  R: {is: resistor, from: supply, to: motor, value: 0.5 ohm}
  motor: {is: transformer, port 1: {domain: electrical, from: motor},
          port 2: {domain: rotational, from: shaft}, value: k_t}
  J: {is: inertia, from: shaft, value: 1e-3 kg·m²}
outputs: [omega(J)]
"""
SCRIPT = """schema: lg_husky_sim/commands/1
about: a left turn
rate: 20
steps:
  - {duration: 2.0, forward: 0.5, yaw: 0.0, ramp: 0.5}
  - {duration: 3.0, forward: 0.5, yaw: 0.4}
"""
HUSKY = (ROOT / 'config' / 'husky.yaml').read_text(encoding='utf-8')
VALIDATORS = {file: jsonschema.Draft7Validator(schema_of(file)) for file in FILES}


def faults(file: str, data: object) -> list[str]:
    """Return what an editor would mark, as JSON has it: dates are texts."""
    plain = json.loads(json.dumps(data, default=str))
    return [f'{"/".join(map(str, error.absolute_path))}: {error.message}'
            for error in VALIDATORS[file].iter_errors(plain)]


def read_settings(data: Any) -> None:
    for section in data.values():
        make_settings(section['ros__parameters'])


def through_file(read: Callable[[Path], object], folder: Path) -> Callable[[Any], None]:
    def read_data(data: Any) -> None:
        path = folder / 'file.yaml'
        path.write_text(yaml_text(data), encoding='utf-8')
        read(path)
    return read_data


def reader(file: str, folder: Path) -> Callable[[Any], Any]:
    return {'graph': through_file(read_netlist, folder),
            'model': lambda data: model_from_data(data, 'file.yaml'),
            'commands': through_file(load_manoeuvre, folder), 'sim_node': read_settings}[file]


def shipped() -> list[tuple[str, str, object]]:
    """List every YAML file of the project that a user could have written."""
    found: list[tuple[str, str, object]] = []
    for path in sorted((ROOT / 'examples' / 'linear_graph').glob('*.yaml')):
        found.append(('graph', path.name, parse_yaml(path.read_text(encoding='utf-8'))))
    for name in ('sim_node.yaml', 'nav2.yaml'):
        text = (ROOT / 'config' / name).read_text(encoding='utf-8')
        found.append(('sim_node', name, parse_yaml(text)))
    found.append(('model', 'husky.yaml', parse_yaml(HUSKY)))
    scripts: Any = parse_yaml((ROOT / 'config' / 'manoeuvres.yaml').read_text(encoding='utf-8'))
    found += [('commands', name, {'schema': SCHEMA, **script})
              for name, script in scripts['manoeuvres'].items()]
    for page in sorted((ROOT / 'docs').glob('*.md')):
        for text in re.findall(r'^```yaml\n(.*?)^```', page.read_text(encoding='utf-8'),
                               re.DOTALL | re.MULTILINE):
            block: Any = parse_yaml(text)
            file = {'elements': 'graph', SCHEMA: 'commands', MODEL: 'model'}.get(
                'elements' if 'elements' in block else block.get('schema', ''), 'sim_node')
            found.append((file, page.name, block))
    return found


SHIPPED = shipped()


@pytest.mark.parametrize('file', FILES)
def test_the_verb_prints_a_schema_of_draft_7(file: str) -> None:
    done = CliRunner().invoke(cli, ['schema', file], catch_exceptions=False)
    schema = json.loads(done.stdout)
    assert schema == schema_of(file)
    jsonschema.Draft7Validator.check_schema(schema)


def test_files_of_each_kind_are_shipped() -> None:
    assert {file for file, _, _ in SHIPPED} == set(FILES)


@pytest.mark.parametrize(('file', 'name', 'data'), SHIPPED,
                         ids=[f'{file} {name}' for file, name, _ in SHIPPED])
def test_shipped_files_fit_their_schema_and_are_read(
        file: str, name: str, data: Any, tmp_path: Path) -> None:
    assert faults(file, data) == []
    reader(file, tmp_path)(data)


def test_models_that_tools_write_fit_the_schema() -> None:
    for kind in catalogue().values():
        if kind.needs_onset:
            continue
        for side, shape in [(side, shape) for side in kind.sides for shape in kind.shapes]:
            effect = Effect(kind.id, side, shape)
            base = load_model()
            parameters = base.parameters.with_entries(
                *(p.parameter() for p in effect.parameters()))
            data = model_data(ModelFile(Structure(effects=(effect,)), parameters))
            assert faults('model', data) == [], (kind.id, side, shape)


BROKEN: list[tuple[str, str, Callable[[Any], None], str]] = [
    ('graph', NETLIST, lambda d: d.update(element={}), "'element' was unexpected"),
    ('graph', NETLIST, lambda d: d['elements']['R'].update({'is': 'resistance'}),
     "'resistance' is not one of"),
    ('graph', NETLIST, lambda d: d['elements']['R'].update(law='diode'), 'elements/R: '),
    ('graph', NETLIST, lambda d: d['elements']['motor'].pop('port 2'),
     "'port 2' is a required property"),
    ('graph', NETLIST, lambda d: d['elements']['V_s'].update(value=12), 'elements/V_s/value: '),
    ('graph', NETLIST, lambda d: d['parameters'].update({'2k': 1}), "'2k' does not match"),
    ('graph', NETLIST, lambda d: d['parameters'].update({'lambda': 1}), "'lambda' does not match"),
    ('model', HUSKY, lambda d: d.pop('schema'), "'schema' is a required property"),
    ('model', HUSKY, lambda d: d['parameters'].pop('mass'), "'mass' is a required property"),
    ('model', HUSKY, lambda d: d['parameters']['mass'].update(value='heavy'),
     'parameters/mass/value: '),
    ('model', HUSKY, lambda d: d['structure'].update(drivetrain='tracks'),
     "'tracks' is not one of"),
    ('model', HUSKY, lambda d: d.update(effects=[{'effect': 'slop'}]), "'slop' is not one of"),
    ('model', HUSKY, lambda d: d.update(effects=[{'effect': 'encoder_scale', 'side': 'top'}]),
     "'top' is not one of"),
    ('model', HUSKY, lambda d: d.update(effects=[
        {'effect': 'slope', 'parameters': {'steep': 1.0}}]), "'steep' was unexpected"),
    ('model', HUSKY, lambda d: d.update(effects=[
        {'effect': 'command_latency', 'parameters': {'latency': 9.0}}]),
     'effects/0/parameters/latency: '),
    ('commands', SCRIPT, lambda d: d['steps'][1].pop('duration'),
     "'duration' is a required property"),
    ('commands', SCRIPT, lambda d: d['steps'][0].update(speed=1.0), "'speed' was unexpected"),
    ('commands', SCRIPT, lambda d: d['steps'][0].update(yaw=900.0), 'steps/0/yaw: 900'),
    ('commands', SCRIPT, lambda d: d.update(steps=[]), 'steps: '),
    ('sim_node', '/**: {ros__parameters: {rate: 50.0}}',
     lambda d: d['/**']['ros__parameters'].update(rate=0.1), 'rate: 0.1 is less than'),
    ('sim_node', '/**: {ros__parameters: {rate: 50.0}}',
     lambda d: d['/**']['ros__parameters'].update(rat=50.0), "'rat' was unexpected"),
    ('sim_node', 'sim_node: {ros__parameters: {}}',
     lambda d: d['sim_node']['ros__parameters'].update(scan='laser'), "'laser' is not one of"),
]


@pytest.mark.parametrize(('file', 'text', 'change', 'marked'), BROKEN, ids=range(len(BROKEN)))
def test_broken_files_are_marked_where_they_are_broken_and_refused(
        file: str, text: str, change: Callable[[Any], None], marked: str, tmp_path: Path) -> None:
    data: Any = parse_yaml(text)
    assert faults(file, data) == []
    change(data)
    assert any(marked in fault for fault in faults(file, data)), faults(file, data)
    with pytest.raises(LgHuskyError):
        reader(file, tmp_path)(data)


def test_no_parameter_of_the_node_is_marked_that_it_accepts() -> None:
    """Of graphs, models and scripts the thousand files of test_fuzz_yaml show the same."""
    text = (ROOT / 'config' / 'sim_node.yaml').read_text(encoding='utf-8')
    values: Any = parse_yaml(text)
    outcomes = {'accepted': 0, 'refused and marked': 0, 'refused': 0}
    for setting in TABLE:
        odd: tuple[Any, ...] = (True, -1, 0, 1, 0.5, 60, 1e6, math.inf, '', 'free', [], {}, None,
                                [1.0] * 6, ['a', 'b', 'c', 'd'], ['a'] * 4)
        for value in odd:
            given = {**values['/**']['ros__parameters'], setting.name: value}
            try:
                make_settings(given)
                assert faults('sim_node', {'/**': {'ros__parameters': given}}) == []
                outcomes['accepted'] += 1
            except LgHuskyError:
                marked = faults('sim_node', {'/**': {'ros__parameters': given}})
                outcomes['refused and marked' if marked else 'refused'] += 1
    assert outcomes['accepted'] > 100, outcomes
    assert outcomes['refused and marked'] > 10 * outcomes['refused'], outcomes
