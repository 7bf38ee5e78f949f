# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Write README's tables of verbs, topics and parameters from the code that they describe.

    python scripts/readme_tables.py          writes them between their markers
    python scripts/readme_tables.py --check  exits 1 if they are out of date
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
import re
import sys
from typing import Any
from unittest import mock

README = Path(__file__).resolve().parent.parent / 'README.md'
PRESETS = ('paper', 'husky_ros1', 'clearpath_jazzy')


def table(head: Iterable[str], rows: Iterable[tuple[object, ...]]) -> str:
    """Return a Markdown table."""
    heading = list(head)
    lines: list[list[object]] = [[*heading], ['---'] * len(heading), *([*row] for row in rows)]
    return '\n'.join('| ' + ' | '.join(str(cell).replace('|', '\\|') for cell in line) + ' |'
                     for line in lines)


def verbs() -> str:
    """Return each verb of lg_husky with the first sentence of its help."""
    import click
    from lg_husky_sim.cli.main import cli
    context = click.Context(cli)
    rows = []
    for verb in cli.list_commands(context):
        command = cli.get_command(context, verb)
        rows.append((f'`{verb}`', command.get_short_help_str(200) if command else ''))
    return table(('verb', 'what it does'), rows)


def published(preset: str) -> dict[str, tuple[str, str]]:
    """Return setting (or fixed topic) to the topic and type that the node's publishers get."""
    from lg_husky_sim.ros import outputs
    from lg_husky_sim.ros.settings import make_settings, preset_values
    made: list[tuple[str, str]] = []

    class Recorder:
        def create_publisher(self, kind: Any, topic: str, qos: object) -> None:
            made.append((topic, kind.name))

    def message_type(kind: str) -> Any:
        return type('Message', (), {'name': kind.replace('/msg/', '/'), 'clock': None})

    settings = make_settings(preset=preset, publish_tf=True, publish_clock=True)
    with (mock.patch.object(outputs, 'message_type', message_type),
          mock.patch.object(outputs.Outputs, 'configure', return_value=None)):
        outputs.Outputs(Recorder(), settings)  # type: ignore[arg-type]
    names = {value: name for name, value in preset_values(preset).items()
             if name.endswith('_topic')}
    return {names.get(topic, topic): (topic, kind) for topic, kind in made}


def topics() -> str:
    """Return the topics of the node under each preset."""
    from lg_husky_sim.ros.control import TOPICS
    from lg_husky_sim.ros.settings import BY_NAME, preset_values
    presets = [preset_values(preset) for preset in PRESETS]
    rows: list[tuple[str, ...]] = []

    def row(way: str, name: str, kind: str, places: list[str], text: str) -> None:
        same = len(set(places)) == 1
        cells = [f'`{place}`' for place in places]
        rows.append((way, kind, *([cells[0], '″', '″'] if same else cells), text))

    row('in', 'command_topic', ' or '.join(dict.fromkeys(p['command_type'] for p in presets)),
        [p['command_topic'] for p in presets], BY_NAME['command_topic'].text)
    row('in', 'initial_pose_topic', 'PoseWithCovarianceStamped',
        [p['initial_pose_topic'] for p in presets], BY_NAME['initial_pose_topic'].text)
    for name, kind, text in TOPICS:
        row('in', name, kind.rpartition('/')[2], [f'~/{name}'] * 3, text)
    every = [published(preset) for preset in PRESETS]
    fixed = {'tf': 'odom_frame to base_frame (publish_tf)',
             '/clock': 'simulated time (publish_clock)'}
    for name, (_, kind) in every[0].items():
        row('out', name, kind.rpartition('/')[2], [one[name][0] for one in every],
            fixed[name] if name in fixed else BY_NAME[name].text)
    return table(('', 'type', *(f'preset `{preset}`' for preset in PRESETS), 'what'), rows)


def shown(value: object) -> str:
    """Return a default as one types it after `-p name:=`."""
    if isinstance(value, bool):
        return f'`{str(value).lower()}`'
    if isinstance(value, (list, tuple)):
        return f'`[{", ".join(map(str, value))}]`'
    return f'`{value}`' if value != '' else "`''`"


def parameters() -> str:
    """Return every parameter of the node: default, range, unit, whether it may change live."""
    from lg_husky_sim.ros.settings import preset_values, TABLE
    defaults = preset_values()
    return table(
        ('parameter', 'default', 'allowed', 'live', 'what'),
        ((f'`{setting.name}`', shown(defaults[setting.name]), setting.allowed(),
          'yes' if setting.live else '', setting.text) for setting in TABLE))


TABLES: dict[str, Callable[[], str]] = {
    'verbs': verbs, 'topics': topics, 'parameters': parameters}


def filled(text: str) -> str:
    """Return the text with each table put between its markers."""
    for name, make in TABLES.items():
        begin, end = f'<!-- table: {name} -->\n', f'\n<!-- end: {name} -->'
        pattern = re.compile(re.escape(begin) + '.*?' + re.escape(end), re.DOTALL)
        if len(pattern.findall(text)) != 1:
            raise ValueError(f'README must hold the markers of table {name} once')
        content = begin + make() + end
        text = pattern.sub(lambda _, content=content: content, text)  # type: ignore[misc]
    return text


def main() -> int:
    """Write README's tables, or say whether they are up to date."""
    before = README.read_text(encoding='utf-8')
    after = filled(before)
    if '--check' in sys.argv[1:]:
        return int(before != after)
    README.write_text(after, encoding='utf-8')
    return 0


if __name__ == '__main__':
    sys.exit(main())
