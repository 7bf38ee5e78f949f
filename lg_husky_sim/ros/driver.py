# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Send a manoeuvre as velocity commands, at the pace of the clock."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.manoeuvres import Manoeuvre
from lg_husky_sim.ros.commands import Commands
from lg_husky_sim.ros.settings import Settings
from lg_husky_sim.ros.tool import Say, Tool

NAME = 'lg_husky_driver'


def drive(tool: Tool, manoeuvre: Manoeuvre, settings: Settings, *, wait: float = 10.0,
          say: Say = print, progress: Callable[[float], object] | None = None) -> int:
    """
    Send the commands of a manoeuvre to whoever listens, then zero, whatever happens.

    Parameters
    ----------
    tool : Tool
        Joins the graph; its clock paces the commands.
    manoeuvre : Manoeuvre
        What to drive.
    settings : Settings
        Topic, type and limits of the command.
    wait : float
        How long to wait for a listener [s].
    say : callable
        Is told what listens, before anything moves, and what was limited.
    progress : callable, optional
        Receives the time within the manoeuvre [s] at each command.

    Returns
    -------
    int
        Number of commands sent, without the zeros at the end.

    Raises
    ------
    CommandError
        If nobody listens, or nobody does any more.
    Ended
        If the tool was asked to end; the robot is stopped then.

    """
    with Commands(tool, settings) as commands:
        commands.wait(wait, say)
        tool.wait_for_time(wait)
        script = manoeuvre.commands()
        start = tool.now()
        for moment, (forward, yaw) in zip(script.times.tolist(), script.values.tolist(),
                                          strict=True):
            tool.serve_until(start + moment)
            tool.orderly.check()
            commands.send(forward, yaw)
            commands.check_heard()
            if progress is not None:
                progress(moment)
    if commands.limited:
        say(f'{commands.limited} of {commands.sent} commands were beyond the limits of preset '
            f'{settings.preset}')
    return commands.sent
