# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The `lg_husky` command: finds the verbs, and turns our errors into one line and an exit code."""

from __future__ import annotations

from collections.abc import Sequence
import difflib
from importlib import import_module
from importlib.util import find_spec
import os
import sys
import traceback
from typing import Any

try:
    import click
except ModuleNotFoundError as error:
    # A ROS workspace whose dependencies were not installed: the node runs, the verbs do not.
    if error.name != 'click':
        raise
    sys.exit('error: click is needed for lg_husky and is not installed: pip install click, or '
             'with ROS sudo apt install python3-click')
from lg_husky_sim.blas import set_one_thread
from lg_husky_sim.errors import LgHuskyError, SEVERAL

MISUSED = 2
"""Exit code after a command line that cannot be understood, as shells expect it."""
INTERRUPTED = 130
"""Exit code after Ctrl-C, as shells expect it (128 + SIGINT)."""

VERBS = {
    'demo': 'lg_husky_sim.cli.demo',
    'info': 'lg_husky_sim.cli.info',
    'derive': 'lg_husky_sim.cli.derive',
    'simulate': 'lg_husky_sim.cli.simulate',
    'drive': 'lg_husky_sim.cli.drive',
    'record': 'lg_husky_sim.cli.record',
    'play': 'lg_husky_sim.cli.play',
    'compare': 'lg_husky_sim.cli.compare',
    'identify': 'lg_husky_sim.cli.identify',
    'evaluate': 'lg_husky_sim.cli.evaluate',
    'diagnose': 'lg_husky_sim.cli.diagnose',
    'plan-drive': 'lg_husky_sim.cli.plan_drive',
    'prove': 'lg_husky_sim.cli.prove',
    'twin': 'lg_husky_sim.cli.twin',
    'import': 'lg_husky_sim.cli.import_',
    'effects': 'lg_husky_sim.cli.effects',
    'parameters': 'lg_husky_sim.cli.parameters',
    'manoeuvres': 'lg_husky_sim.cli.manoeuvres',
    'schema': 'lg_husky_sim.cli.schema',
}
"""Verb to the module whose `command` is its click command, in the order of a newcomer's tour."""


# A group of verbs within a verb, called without arguments; click has the class since 8.2.
_NO_ARGUMENTS: Any = getattr(click.exceptions, 'NoArgsIsHelpError', ())


class LazyGroup(click.Group):
    """A group whose commands are imported when asked for, so that each verb starts quickly."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return [verb for verb, module in VERBS.items() if find_spec(module) is not None]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in self.list_commands(ctx):
            return None
        command = import_module(VERBS[cmd_name]).command
        if not isinstance(command, click.Command):
            message = f'{VERBS[cmd_name]}.command is no click command'
            raise TypeError(message)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str],
    ) -> tuple[str | None, click.Command | None, list[str]]:
        verb = args[0]
        if not verb.startswith('-') and verb not in self.list_commands(ctx):
            known = self.list_commands(ctx)
            near = difflib.get_close_matches(verb, known, n=1)
            hint = f'; did you mean {near[0]}?' if near else ''
            message = f'{verb} is not a verb{hint} (there are: {", ".join(known)})'
            raise click.UsageError(message, ctx)
        return super().resolve_command(ctx, args)


def version() -> str:
    """Return the installed version, or that there is none (a source tree without install)."""
    import lg_husky_sim
    return lg_husky_sim.__version__


@click.group(
    cls=LazyGroup,
    context_settings={'help_option_names': ['-h', '--help']},
    epilog='Completion for your shell: eval "$(_LG_HUSKY_COMPLETE=bash_source lg_husky)" '
           '(or zsh_source, fish_source). The live node is a program of its own: sim_node.',
)
@click.version_option(version(), '-V', '--version', prog_name='lg_husky')
def cli() -> None:
    """Digital twin of the Clearpath Husky: derive, simulate, compare, identify, diagnose."""


def run(arguments: Sequence[str] | None = None) -> int:
    """
    Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        The arguments without the program's name; those of the process by default.

    Returns
    -------
    int
        Exit code: 0 done, 1 bad input or a file that cannot be read or written, 2 a command that
        cannot be understood (one line on standard error says what), 130 interrupted.

    """
    set_one_thread()
    given = list(sys.argv[1:] if arguments is None else arguments)
    try:
        code = cli.main(given or ['--help'], prog_name='lg_husky', standalone_mode=False)
    except (click.exceptions.Abort, KeyboardInterrupt):
        return fail('interrupted', INTERRUPTED)
    except click.UsageError as error:
        if isinstance(error, _NO_ARGUMENTS):
            error.show()
            return MISUSED
        where = error.ctx.command_path if error.ctx else 'lg_husky'
        return fail(f'error: {error.format_message()} (see {where} -h)', MISUSED)
    except click.ClickException as error:
        return fail(f'error: {error.format_message()}')
    except BrokenPipeError:
        # The reader (head, less) has left; keep the interpreter from flushing into nothing.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except LgHuskyError as error:
        if {'-v', '--verbose'} & set(given):
            traceback.print_exc()
        return fail(f'error: {error}')
    except OSError as error:
        named = error.filename is not None and error.strerror
        return fail(f'error: {error.filename}: {error.strerror}' if named else f'error: {error}')
    return code if isinstance(code, int) else 0


def fail(message: str, code: int = 1) -> int:
    """Print the message on standard error, in one line for each error; return the exit code."""
    lines = [' '.join(line.split()) for line in message.split(SEVERAL)]
    head, colon, rest = SEVERAL.join(lines).partition(':')
    # click drops the colour where it is no terminal, or NO_COLOR is set.
    colour = 'red' if colon and 'NO_COLOR' not in os.environ else None
    click.echo(click.style(head + colon, fg=colour) + rest, err=True)
    return code


def main() -> None:
    """Run the command line as a process: the entry point `lg_husky`."""
    sys.exit(run())


if __name__ == '__main__':
    main()
