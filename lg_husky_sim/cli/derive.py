# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky derive`: from a linear graph to its equations and its state-space model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click
from lg_husky_sim.cli.common import misused, Output, spoken, Words

if TYPE_CHECKING:
    from lg_husky_sim.api.graphs import Graph

PAPER = ('simplified', 'expanded')


@click.command(short_help='Derive the state-space model of a linear graph; draw and export it.')
@click.argument('graph', required=False, metavar='[GRAPH]', type=Words(lambda: PAPER, files=True))
@click.option('--model', '--robot', 'model', metavar='GRAPH',
              type=Words(lambda: PAPER, files=True),
              help='Another way to give GRAPH, as in other verbs.')
@click.option('--output', 'outputs', multiple=True, metavar='VARIABLE',
              help="An output variable, such as 'i(L_1)'; may be given several times.")
@click.option('--parameters', 'by_parameter', is_flag=True,
              help="Write the parameters' expressions instead of the elements' names.")
@click.option('--latex', is_flag=True, help='Write LaTeX instead of plain text.')
@click.option('--picture', 'pictures', multiple=True, type=click.Path(path_type=Path),
              metavar='FILE',
              help='Draw the graph into FILE (.svg, .png or .pdf); may be given several times.')
@click.option('--export', 'exports', multiple=True, type=click.Path(path_type=Path),
              metavar='FILE',
              help='Write numeric A, B, C and D: .json, .mat, .npz, .h (C), .tex or .py '
                   '(python-control, scipy); may be given several times.')
@spoken()
def command(graph: str | None, model: str | None, outputs: tuple[str, ...],
            by_parameter: bool, latex: bool, pictures: tuple[Path, ...],
            exports: tuple[Path, ...], say: Output) -> None:
    """
    Derive the state-space model of a linear graph and show every step.

    GRAPH is a netlist, a model file or one of the paper's two graphs of the Husky, simplified
    (the default) or expanded.

    The steps are the normal tree, the continuity, compatibility and constitutive equations, and
    the matrices A, B, C and D. There are E and F if an input is differentiated, and G, H and K if
    laws are not linear. Where all parameters have numbers, matrices in numbers and poles follow.
    """
    import json

    from lg_husky_sim.linear_graph.drawing import check_picture
    from lg_husky_sim.linear_graph.export import check_export, json_text

    for path in pictures:
        check_picture(path)
    for path in exports:
        check_export(path)
    if graph and model:
        message = f'{graph} and --model {model} are given; one graph is derived at a time'
        raise misused(message)
    derived = _load(graph or model or PAPER[0], outputs)
    text = derived.latex(by_parameter) if latex else derived.text(by_parameter)
    for path in pictures:
        derived.draw(path)
    for path in exports:
        derived.export(path)
    data = json.loads(json_text(derived.numeric(), derived.name, derived.values)) if (
        say.as_json) else None
    say.result(text, data)
    for path in (*pictures, *exports):
        if not say.quiet:
            click.echo(f'{path} written', err=True)


def _load(model: str, outputs: tuple[str, ...]) -> Graph:
    """Find the graph with numbers and outputs that the option names."""
    from lg_husky_sim.api.graphs import graph
    from lg_husky_sim.errors import ModelFileError

    if model in PAPER:
        return graph(model, outputs)
    path = Path(model)
    if path.suffix.lower() not in ('.yaml', '.yml'):
        raise ModelFileError(f'model {model!r} must be {", ".join(PAPER)} or a .yaml file')
    return graph(path, outputs)
