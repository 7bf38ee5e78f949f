# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
What deriving a linear graph costs, and how it grows with the graph.

Usage: ``python benchmarks/linear_graph.py [--json FILE]``. Ladders of inductors, resistors and
capacitors have 10, 30 and 100 storages; chains have 10, 20 and 40 transformers. Growth is the
exponent p in time ~ storages^p between the two largest.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
import json
import math
from pathlib import Path
import subprocess
import sys
import time

from lg_husky_sim.husky import network
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.linear_graph import (
    Branch,
    compile_numeric,
    derive,
    Domain,
    Kind,
    LinearGraph,
    normal_tree,
    TwoPort,
)

REPEATS = 5
SIZES = (10, 30, 100)
CHAINS = (10, 20, 40)


def ladder(storages: int) -> LinearGraph:
    """Return a ladder of cells with an inductor, a resistor and a capacitor each."""
    branches = [Branch('V', Kind.ACROSS_SOURCE, Domain.ELECTRICAL, 'n0', 'ground')]
    for k in range(storages // 2):
        branches += [
            Branch(f'L{k}', Kind.T_TYPE, Domain.ELECTRICAL, f'n{k}', f'm{k}', f'L{k}'),
            Branch(f'R{k}', Kind.D_TYPE, Domain.ELECTRICAL, f'm{k}', f'n{k + 1}', f'R{k}'),
            Branch(f'C{k}', Kind.A_TYPE, Domain.ELECTRICAL, f'n{k + 1}', 'ground', f'C{k}')]
    return LinearGraph(tuple(branches))


def chain(transformers: int) -> LinearGraph:
    """Return stages of a resistor and a capacitor, coupled by transformers."""
    branches = [Branch('V', Kind.ACROSS_SOURCE, Domain.ELECTRICAL, 'n0', 'ground')]
    two_ports = []
    for k in range(transformers):
        branches += [
            Branch(f'R{k}', Kind.D_TYPE, Domain.ELECTRICAL, f'n{k}', f'm{k}', f'R{k}'),
            Branch(f'C{k}', Kind.A_TYPE, Domain.ELECTRICAL, f'm{k}', 'ground', f'C{k}')]
        two_ports.append(TwoPort(f'T{k}', Kind.TRANSFORMER, (Domain.ELECTRICAL, f'm{k}', 'ground'),
                                 (Domain.ELECTRICAL, f'n{k + 1}', 'ground'), f'T{k}'))
    branches.append(Branch('load', Kind.D_TYPE, Domain.ELECTRICAL, f'n{transformers}', 'ground',
                           'load'))
    return LinearGraph(tuple(branches), tuple(two_ports))


def best(run: Callable[[], object], count: int = 1) -> float:
    """Return the shortest time of one call [s] of several turns: the one least disturbed."""
    shortest = math.inf
    for _ in range(REPEATS):
        began = time.perf_counter()
        for _ in range(count):
            run()
        shortest = min(shortest, (time.perf_counter() - began) / count)
    return shortest


def growth(times: dict[int, float]) -> float:
    """Return the exponent between the two largest sizes."""
    (small, one), (large, two) = sorted(times.items())[-2:]
    return math.log(two / one) / math.log(large / small)


def fresh_start() -> float:
    """Return how long a new process takes to import the module and derive the Husky [s]."""
    code = ('import numpy, time; began = time.perf_counter(); '
            'from lg_husky_sim.husky.network import simplified; '
            'from lg_husky_sim.linear_graph import compile_numeric; '
            "compile_numeric(simplified(), ['v(M_H)']); print(time.perf_counter() - began)")
    shown = [subprocess.run([sys.executable, '-c', code], capture_output=True, text=True,
                            check=True).stdout for _ in range(REPEATS)]
    return min(float(text) for text in shown)


def measure() -> dict[str, dict[str, float]]:
    """Measure everything; times in seconds."""
    found: dict[str, dict[str, float]] = {}
    for name, graph in (('Husky, simplified', network.simplified()),
                        ('Husky, expanded', network.expanded())):
        model = compile_numeric(graph, ['v(M_H)'])
        values = dict(load_model().parameters)
        for missing in model.parameters:
            values.setdefault(missing, 1.0)
        found[name] = {
            'analyse': best(partial(compile_numeric, graph, ['v(M_H)'])),
            'numbers': best(partial(model.at, values), 200),
            'symbols': best(partial(derive, graph, ['v(M_H)']))}
    found['Husky, simplified']['start'] = fresh_start()
    for size in SIZES:
        graph = ladder(size)
        model = compile_numeric(graph)
        values = {name: 1.0 + 0.01 * at for at, name in enumerate(model.parameters)}
        found[f'ladder of {size}'] = {
            'analyse': best(partial(compile_numeric, graph)),
            'numbers': best(partial(model.at, values), 20),
            'symbols': best(partial(derive, graph))}
    for count in CHAINS:
        graph = chain(count)
        found[f'{count} transformers'] = {
            'tree': best(partial(normal_tree, graph))}
    return found


def main() -> None:
    """Print a table, and write it as JSON if asked."""
    found = measure()
    columns = ('analyse', 'numbers', 'symbols', 'start', 'tree')
    print(f'{"[ms]":<20}' + ''.join(f'{name:>12}' for name in columns))
    for name, times in found.items():
        print(f'{name:<20}' + ''.join(
            f'{1e3 * times[column]:>12.3f}' if column in times else f'{"":>12}'
            for column in columns))
    for column in ('analyse', 'numbers', 'symbols'):
        power = growth({size: found[f'ladder of {size}'][column] for size in SIZES})
        print(f'{column}: grows as storages^{power:.1f}')
    power = growth({count: found[f'{count} transformers']['tree'] for count in CHAINS})
    print(f'tree: grows as transformers^{power:.1f}')
    if '--json' in sys.argv:
        path = Path(sys.argv[sys.argv.index('--json') + 1])
        path.write_text(json.dumps(found, indent=2) + '\n', encoding='utf-8')


if __name__ == '__main__':
    main()
