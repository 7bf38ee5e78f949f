# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Where the numbers and the names of a diagnosis stand: in configuration, not in code."""

from __future__ import annotations

import ast
from pathlib import Path
import re
from typing import Any

from lg_husky_sim.diagnosis.evidence.noise import NAMES
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.effects import catalogue, Subsystem
import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / 'lg_husky_sim'
DIAGNOSIS = {path.relative_to(PACKAGE / 'diagnosis').as_posix(): path.read_text()
             for path in sorted((PACKAGE / 'diagnosis').rglob('*.py'))}
CODE = '\n'.join(path.read_text() for path in sorted(PACKAGE.rglob('*.py')))
SETTINGS: dict[str, Any] = yaml.safe_load((ROOT / 'config' / 'diagnosis.yaml').read_text())
ENTRIES = {name: entry for section, entries in SETTINGS.items() if section != 'schema'
           for name, entry in entries.items()}
#: Sizes of arrays, layouts and identities: no physics and no statistics.
LAYOUT = {'STATES', 'BALANCES', 'NEUTRAL', 'LEAST_CHANCE', 'TOGETHER', 'ROWS', 'DENSITY'}
#: Who may name an effect, and which: a wording; the base robot, whose parameters have such names;
#: and that base as a model of the library, which is made of effects.
NAMED = {
    'conclusion.py': {'yaw_pull'},
    'wording.py': {'sensor_time_offset'},
    'before_after/base_names.py': {'current_limit'},
    'before_after/conclusion.py': {'gyro_sign'},
    'before_after/prediction.py': {'gyro_bias'},
    'before_after/runnable.py': {'command_latency', 'command_slew', 'coulomb_drivetrain',
                                 'current_limit', 'slope', 'speed_loop', 'traction_saturation',
                                 'wheel_radius_mismatch'},
}


@pytest.mark.parametrize('name', ENTRIES)
def test_every_number_has_a_value_a_unit_and_a_meaning(name: str) -> None:
    entry = ENTRIES[name]
    assert isinstance(entry['value'], int | float)
    assert entry['unit']
    assert len(entry['meaning']) > 5
    assert setting(name) == entry['value']


@pytest.mark.parametrize('name', ENTRIES)
def test_every_number_is_used_somewhere(name: str) -> None:
    prefix, _, rest = name.partition('_')
    each = {*NAMES, *(part.value for part in Subsystem)}
    by_each = re.search(rf"setting\(\s*f'{prefix}_{{", CODE) and rest in each
    assert re.search(rf"'{name}'", CODE) or by_each


def test_no_two_numbers_have_one_name() -> None:
    assert len(ENTRIES) == sum(len(v) for k, v in SETTINGS.items() if k != 'schema')


@pytest.mark.parametrize('module', DIAGNOSIS)
def test_no_number_stands_at_the_head_of_a_module(module: str) -> None:
    for node in ast.parse(DIAGNOSIS[module]).body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
            target = node.targets[0] if isinstance(node, ast.Assign) else node.target
            numbers = [c.value for c in ast.walk(node.value) if isinstance(c, ast.Constant)
                       and isinstance(c.value, int | float) and not isinstance(c.value, bool)]
            assert not numbers or ast.unparse(target) in LAYOUT, ast.unparse(node)


@pytest.mark.parametrize('module', DIAGNOSIS)
def test_only_listed_modules_name_an_effect(module: str) -> None:
    named = {c.value for c in ast.walk(ast.parse(DIAGNOSIS[module]))
             if isinstance(c, ast.Constant) and isinstance(c.value, str)
             and c.value in catalogue()}
    assert named <= NAMED.get(module, set())


def test_the_largest_payload_stands_in_the_documentation() -> None:
    text = (ROOT / 'docs' / 'diagnosis.md').read_text(encoding='utf-8')
    said = re.search(r'`largest_load`: (\d+) kg on a Husky', text)
    assert said is not None
    assert float(said[1]) == setting('largest_load')
