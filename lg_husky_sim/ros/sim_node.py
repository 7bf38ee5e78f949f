# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The node: translates messages and paces steps; the physics is elsewhere.

``ros2 run lg_husky_sim sim_node`` with ROS 2, ``sim_node`` without it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
import gc
import os
import signal
import sys
import time
from typing import Any, TYPE_CHECKING

if TYPE_CHECKING:
    from types import FrameType

NAME = 'sim_node'


def _leave(number: int, frame: FrameType | None) -> None:
    # Nothing is open yet. An exception would not do: an extension module that is being loaded
    # turns it into an ImportError, and CPython ends by the signal where a KeyboardInterrupt has
    # passed through an exec of text, as many imports do one.
    os._exit(0)


def _on_signals(handler: Callable[[int, FrameType | None], None] | signal.Handlers) -> None:
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, handler)


def main(args: Sequence[str] | None = None) -> int:
    """
    Run the node until Ctrl-C or SIGTERM.

    Parameters
    ----------
    args : sequence of str, optional
        Command line; ``sys.argv`` if not given.

    Returns
    -------
    int
        0 after a clean end, 1 if arguments, parameters or files are wrong.

    """
    # Imports take most of the start; a signal during them ends the process cleanly as well.
    _on_signals(_leave)
    return _run(args)


def _run(args: Sequence[str] | None) -> int:
    started = time.monotonic()
    from lg_husky_sim.errors import LgHuskyError
    from lg_husky_sim.ros.usage import asked_for_help, usage
    words = list(sys.argv if args is None else args)
    if asked_for_help(words[1:]):
        # A pager that is left early is no error.
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
        print(usage())
        return 0
    try:
        from lg_husky_sim.ros import api
        from lg_husky_sim.ros.simulation_node import SimNode
    except LgHuskyError as error:
        print(f'error: {error}', file=sys.stderr)
        return 1
    if foreign := api.own_arguments(words[1:]):
        print(f'error: unknown argument {foreign[0]!r}: parameters go after --ros-args -p, such '
              'as --ros-args -p rate:=100.0 (see sim_node -h)', file=sys.stderr)
        return 1
    node: Any = None
    joined, code = False, 0
    # From here on the middleware's own handlers shut the graph down, which ends spinning. What
    # comes before they are there is kept in mind.
    asked: list[int] = []
    _on_signals(lambda number, frame: asked.append(number))
    try:
        api.init(args=words)
        joined = True
        node = SimNode(NAME, started=started, leave=api.leave)
        # What is loaded now stays: the garbage collector need not look through it at each turn,
        # which would make steps late.
        gc.freeze()
        if not asked:
            api.keep_spinning(node)
    except (KeyboardInterrupt, api.ExternalShutdownException):
        code = 0
    except Exception as error:
        # A signal takes the node out of the graph while it is still being put together; what
        # then fails is no mistake.
        if not joined or api.ok():
            if not isinstance(error, api.USER_ERRORS):
                raise
            print(f'error: {api.reason(error)}', file=sys.stderr)
            code = 1
    finally:
        _on_signals(signal.SIG_IGN)
        if node is not None:
            node.destroy_node()
        api.try_shutdown()
    return code


if __name__ == '__main__':
    sys.exit(main())
