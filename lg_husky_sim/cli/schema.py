# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky schema`: what may stand in a YAML file, for editors that complete and check it."""

from __future__ import annotations

from collections.abc import Callable
import json
from typing import Any

import click
from lg_husky_sim.cli.common import OneOf


def _graph() -> dict[str, Any]:
    from lg_husky_sim.linear_graph.netlist_schema import json_schema
    return json_schema()


def _model() -> dict[str, Any]:
    from lg_husky_sim.husky.model_file import load_model
    from lg_husky_sim.husky.model_schema import json_schema
    return json_schema({p.name: f'[{p.unit}] {p.source}'
                        for p in load_model().parameters.entries})


def _commands() -> dict[str, Any]:
    from lg_husky_sim.manoeuvres import json_schema
    return json_schema()


def _sim_node() -> dict[str, Any]:
    from lg_husky_sim.ros.settings_schema import json_schema
    return json_schema()


FILES: dict[str, Callable[[], dict[str, Any]]] = {
    'graph': _graph, 'model': _model, 'commands': _commands, 'sim_node': _sim_node}


def schema_of(file: str) -> dict[str, Any]:
    """Return the JSON schema of a kind of file, one of :data:`FILES`."""
    return {'$schema': 'http://json-schema.org/draft-07/schema#', **FILES[file]()}


@click.command(short_help='Print the JSON schema of a YAML file, for editors.')
@click.argument('file', type=OneOf(list(FILES)))
def command(file: str) -> None:
    """
    Print the JSON schema of a kind of YAML file.

    An editor with a YAML language server completes and checks a file whose first line is, for
    example, "# yaml-language-server: $schema=model.json", after
    "lg_husky schema model > model.json".
    """
    click.echo(json.dumps(schema_of(file), indent=1, ensure_ascii=False, allow_nan=False))
