# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The tutorial page, run block by block; what it prints is what the page says."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path
import re
import shlex
from typing import Any

from lg_husky_sim.cli.main import run
import pytest

PAGE = Path(__file__).resolve().parents[2] / 'docs' / 'linear_graph.md'
BLOCK = re.compile(r'^```(\w+)\n(.*?)^```$', re.MULTILINE | re.DOTALL)


def test_the_page_runs_and_prints_what_it_says(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    blocks = BLOCK.findall(PAGE.read_text(encoding='utf-8'))
    assert [kind for kind, _ in blocks].count('python') >= 6
    names: dict[str, Any] = {'__name__': 'tutorial'}
    printed = ''
    compared = 0
    for kind, body in blocks:
        if kind == 'yaml':
            Path('motor.yaml').write_text(body, encoding='utf-8')
        elif kind == 'shell':
            program, *arguments = shlex.split(body)
            assert program == 'lg_husky'
            assert run(arguments) == 0
            assert Path('motor.svg').is_file()
        elif kind == 'python':
            with contextlib.redirect_stdout(io.StringIO()) as out:
                exec(compile(body, str(PAGE), 'exec'), names)
            printed = out.getvalue()
        elif kind == 'text':
            assert printed.rstrip('\n') == body.rstrip('\n')
            compared += 1
    assert compared >= 6


def test_the_table_of_elements_names_each_and_its_unit() -> None:
    from lg_husky_sim.linear_graph import Branch
    from lg_husky_sim.linear_graph.elements import SOURCES
    from lg_husky_sim.linear_graph.netlist_schema import ELEMENTS
    from lg_husky_sim.linear_graph.units import unit_needed
    page = PAGE.read_text(encoding='utf-8')
    for name, (kind, domain) in ELEMENTS.items():
        assert f' {name} ' in page
        if kind not in SOURCES:
            unit = unit_needed(Branch('x', kind, domain, 'a', 'b', 'x'))
            assert f' {name} [{unit}] ' in page


def test_what_integrates_a_variable_puts_no_load_on_it() -> None:
    import lg_husky_sim as lg
    circuit = {'V': {'is': 'voltage source', 'from': 'a'},
               'R': {'is': 'resistor', 'from': 'a', 'to': 'b', 'value': '2 ohm'},
               'C': {'is': 'capacitor', 'from': 'b', 'value': '0.5 F'}}
    counted = lg.graph({'elements': {
        **circuit,
        'follow': {'is': 'current source', 'from': 'ground', 'to': 'n', 'law': 'z',
                   'of': ['i(R)']},
        'charge': {'is': 'capacitor', 'from': 'n', 'value': '1 F'}}})
    times = [0.0, 0.5, 1.0, 1.5, 2.0]
    # The charge on C: C V(C), with and without the integrator.
    alone = lg.graph({'elements': circuit}).step(times, 'V(C)').values[:, 0]
    assert counted.step(times, 'V(C)').values[:, 0] == pytest.approx(alone, rel=1e-9)
    assert counted.step(times, 'V(charge)').values[:, 0] == pytest.approx(0.5 * alone, rel=1e-6)
