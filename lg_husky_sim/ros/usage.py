# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What `sim_node --help` says, from the table of settings."""

from __future__ import annotations

from collections.abc import Sequence

HEAD = """\
Usage: sim_node [--ros-args [-p NAME:=VALUE]... [-r FROM:=TO]... [--params-file FILE.yaml]...]

  The live Husky: takes velocity commands, publishes odometry, joint states and IMU until Ctrl-C.

  sim_node --ros-args -p preset:=clearpath_jazzy -p rate:=200.0
  sim_node --ros-args -p model:=model.yaml -r __ns:=/a200

Parameters (default under the preset paper; * may change while it runs):
"""


def asked_for_help(words: Sequence[str]) -> bool:
    """Return whether -h or --help stands before any argument for ROS."""
    own = words[:words.index('--ros-args')] if '--ros-args' in words else words
    return '-h' in own or '--help' in own


def usage() -> str:
    """Return the help text."""
    from lg_husky_sim.ros.settings import preset_values, TABLE
    defaults = preset_values()
    lines = []
    for setting in TABLE:
        mark = '*' if setting.live else ' '
        value = defaults[setting.name]
        shown = str(value).lower() if isinstance(value, bool) else repr(value)
        lines.append(f'{mark} {setting.name} = {shown}\n      {setting.text} '
                     f'({setting.allowed()})')
    return HEAD + '\n'.join(lines)
