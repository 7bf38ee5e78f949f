# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky derive`: from a linear graph to its equations and its state-space model."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from lg_husky_sim.husky.model import Structure
    from lg_husky_sim.husky.model_file import ModelFile
    from lg_husky_sim.linear_graph import LinearGraph, NumericModel
    from lg_husky_sim.linear_graph.netlist import Netlist

PAPER = ('simplified', 'expanded')


@click.command(short_help='Derive the state-space model of a linear graph; draw the graph.')
@click.option('--model', default='simplified', show_default=True,
              metavar='simplified|expanded|FILE.yaml',
              help="One of the paper's two graphs of the Husky, a netlist, or a model file.")
@click.option('--output', 'outputs', multiple=True, metavar='VARIABLE',
              help="A variable to put out, such as 'i(L_1)'; may be given several times.")
@click.option('--parameters', 'by_parameter', is_flag=True,
              help="Write the parameters' expressions instead of the elements' names.")
@click.option('--latex', is_flag=True, help='Write LaTeX instead of plain text.')
@click.option('--picture', type=click.Path(path_type=Path), metavar='FILE',
              help='Draw the graph into FILE (.svg, .png or .pdf).')
def command(model: str, outputs: tuple[str, ...], by_parameter: bool, latex: bool,
            picture: Path | None) -> None:
    """
    Derive the state-space model of a linear graph and write down every step.

    Normal tree, continuity, compatibility and constitutive equations, then A, B, C and D (E and
    F where an input is differentiated, G, H and K where laws are not linear), and with numbers
    the poles.
    """
    from lg_husky_sim.linear_graph import compile_numeric, derive
    from lg_husky_sim.linear_graph.equations import equations
    from lg_husky_sim.linear_graph.report import latex_report, text_report

    netlist, note = _load(model)
    wanted = outputs or netlist.outputs
    numeric = compile_numeric(netlist.graph, wanted, chained=True)
    symbolic = derive(netlist.graph, wanted, by_element=not by_parameter)
    steps = equations(netlist.graph, by_element=not by_parameter)
    if picture is not None:
        from lg_husky_sim.linear_graph.drawing import save_picture
        save_picture(netlist.graph, picture, title=netlist.name)
    if latex:
        click.echo(latex_report(netlist.name, steps, symbolic, note))
    else:
        click.echo(text_report(netlist.name, steps, symbolic,
                               None if by_parameter else netlist.graph,
                               _with_numbers(numeric, netlist.values), note))
    if picture is not None:
        click.echo(f'picture: {picture}', err=True)


def _load(model: str) -> tuple[Netlist, str]:
    """Find the graph with numbers and outputs that the option names, and what to note of it."""
    from lg_husky_sim.errors import ModelFileError
    from lg_husky_sim.husky import network
    from lg_husky_sim.husky.model_file import load_model
    from lg_husky_sim.linear_graph.netlist import Netlist, read_netlist
    from lg_husky_sim.yaml_files import read_yaml

    if model in PAPER:
        graph = network.simplified() if model == 'simplified' else network.expanded()
        return Netlist(f'Husky, {model} drivetrain', graph, load_model().parameters,
                       _paper_outputs(graph)), ''
    path = Path(model)
    if path.suffix not in ('.yaml', '.yml'):
        raise ModelFileError(f'model {model!r} must be {", ".join(PAPER)} or a .yaml file')
    try:
        top = read_yaml(path, ModelFileError)
    except ModelFileError as error:
        raise ModelFileError(f'{path}: {error}') from error
    if 'elements' in top:
        return read_netlist(path), ''
    loaded = load_model(path)
    graph = loaded.structure.network().graph
    return Netlist(loaded.about or path.stem, graph, _values(loaded),
                   _paper_outputs(graph)), _shown(loaded.structure)


def _values(model: ModelFile) -> Mapping[str, float]:
    """Return the parameters by the names of the graph, where changed effects have others."""
    values = dict(model.parameters)
    for effect in model.structure.in_force():
        values.update({name: model.parameters[own] for name, own in effect.renamed.items()})
    return values


def _shown(structure: Structure) -> str:
    """Say which effects are no part of the graph, and which of two graphs it is."""
    from lg_husky_sim.husky.effects import Subsystem

    names = dict.fromkeys(effect.id for effect in structure.in_force() if effect.kind.subsystem
                          in (Subsystem.COMMAND, Subsystem.SENSOR))
    left_out = ('Not in the matrices and poles, which are those of the graph alone: '
                f'{", ".join(names)}') if names else ''
    late = dict.fromkeys(effect.id for effect in structure.in_force() if effect.late)
    onset = f'The model after the onset of {", ".join(late)}' if late else ''
    return '. '.join(text for text in (onset, left_out) if text)


def _paper_outputs(graph: LinearGraph) -> tuple[str, ...]:
    """Return the outputs of eq. (18): the wheels' rates, forward speed and yaw rate."""
    sides = ('J_LW', 'J_RW') if 'J_LW' in graph.names else ('J_RL', 'J_RR')
    return (*(f'omega({name})' for name in sides), 'v(M_H)', 'omega(J_H)')


def _with_numbers(numeric: NumericModel, values: Mapping[str, float],
                  ) -> tuple[NumericModel, Mapping[str, float]] | None:
    """Return the model with its numbers if every parameter has one."""
    return (numeric, values) if all(name in values for name in numeric.parameters) else None
