# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What all verbs share: how much is said, as what, and what can be completed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
import functools
import json
from pathlib import Path
import sys
from typing import Any, TYPE_CHECKING, TypeVar

import click
from click.shell_completion import CompletionItem

if TYPE_CHECKING:
    from lg_husky_sim.recording import TopicMap

    _TextType = click.ParamType[str]
    _ChoiceType = click.Choice[str]
else:
    _TextType = click.ParamType  # generic since click 8.4 only
    _ChoiceType = click.Choice

Function = TypeVar('Function', bound=Callable[..., object])
#: Stages that end within this time are not worth a line in a log [s].
BRIEF = 1.0


@dataclass(frozen=True)
class Output:
    """
    How a verb speaks.

    Parameters
    ----------
    as_json : bool
        Print the result as JSON, and nothing else, on standard output.
    quiet : bool
        No progress and no remarks: only the result.
    verbose : bool
        One line a stage with its time, on a terminal too.
    opened : bool
        Open the page that was written.

    """

    as_json: bool = False
    quiet: bool = False
    verbose: bool = False
    opened: bool = False

    @property
    def progress(self) -> Any:
        """Return what the functions of the API take as ``progress``."""
        from lg_husky_sim.api.progress import Lines

        if self.quiet:
            return False
        if sys.stderr.isatty() and not self.verbose:
            return True
        return Lines(functools.partial(click.echo, err=True), 0.0 if self.verbose else BRIEF)

    @contextmanager
    def stages(self, known: bool = True) -> Iterator[Callable[[str, float | None], None]]:
        """Show progress while the block runs; yields what is told stage and share."""
        from lg_husky_sim.api.progress import shown

        with shown(self.progress, known) as report:
            yield report

    def result(self, text: object, data: object = None) -> None:
        """
        Print a result.

        Parameters
        ----------
        text : object
            A Table, or what prints itself.
        data : object, optional
            The same as plain data; by default the table's.

        """
        from lg_husky_sim.api.tables import Table

        if self.as_json:
            plain = text.data() if data is None and isinstance(text, Table) else data
            click.echo(json.dumps(plain, indent=1, ensure_ascii=False, allow_nan=False))
        elif isinstance(text, Table) and sys.stdout.isatty():
            from lg_husky_sim.cli.terminal import print_table
            print_table(text, _console())
        elif sys.stdout.isatty():
            from lg_husky_sim.cli.terminal import marked
            _console().print(marked(str(text)), soft_wrap=True)
        else:
            click.echo(str(text))

    def remark(self, text: str) -> None:
        """Print what is good to know, unless quiet; beside JSON on standard error."""
        if not self.quiet:
            click.echo(text, err=self.as_json)

    def written(self, path: Path, more: str = '') -> None:
        """Say where the page is, and open it if that was asked for."""
        self.remark(f'{path}{more}')
        if self.opened:
            click.launch(str(path.resolve()))


def _console() -> Any:
    from rich.console import Console
    return Console(highlight=False)


def misused(message: str) -> click.UsageError:
    """Return the error of a command line that contradicts itself, which ends with 2."""
    return click.UsageError(message, click.get_current_context())


def spoken(*, page: bool = False, data: bool = True) -> Callable[[Function], Function]:
    """
    Add ``-q``, ``-v``, ``--json`` and ``--open`` to a verb; it gets an `Output` as ``say``.

    Parameters
    ----------
    page : bool
        Whether the verb writes a page that can be opened.
    data : bool
        Whether its result can be printed as JSON.

    """
    def decorate(function: Function) -> Function:
        @functools.wraps(function)
        def wrapped(*args: Any, quiet: bool, verbose: bool, as_json: bool = False,
                    opened: bool = False, **kwargs: Any) -> object:
            if quiet and verbose:
                raise click.UsageError('-q and -v exclude each other')
            return function(*args, say=Output(as_json, quiet, verbose, opened), **kwargs)
        options = [
            click.option('-q', '--quiet', is_flag=True, help='Print the result only.'),
            click.option('-v', '--verbose', is_flag=True,
                         help='Print one line per stage, and where an error comes from.')]
        if data:
            options.append(click.option('--json', 'as_json', is_flag=True,
                                        help='Print the result as JSON.'))
        if page:
            options.append(click.option('--open', 'opened', is_flag=True,
                                        help='Open the page once it is written.'))
        for option in reversed(options):
            wrapped = option(wrapped)
        return wrapped  # type: ignore[return-value]
    return decorate


class OneOf(_ChoiceType):
    """One of some words; for another one, the nearest is suggested."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None
                ) -> Any:
        """Return the word, or say which there are."""
        import difflib

        known = [str(word) for word in self.choices]
        if value not in known:
            near = difflib.get_close_matches(str(value), known, n=1)
            hint = f'; did you mean {near[0]}?' if near else ''
            self.fail(f'{value!r} is not one of {", ".join(known)}{hint}', param, ctx)
        return super().convert(value, param, ctx)


class Words(_TextType):
    """
    A text of which the shell completes the last word of a list.

    Parameters
    ----------
    known : callable
        Returns the words that can be chosen.
    separator : str
        Between the words of a list; empty for a single word.
    ending : str
        Put behind a completed word, such as ``=``.
    files : bool
        Whether it may be a file as well.

    """

    name = 'text'

    def __init__(self, known: Callable[[], Sequence[str]], separator: str = '',
                 ending: str = '', files: bool = False) -> None:
        """Keep what is asked when the shell completes."""
        self._known, self._separator = known, separator
        self._ending, self._files = ending, files

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None
                ) -> Any:
        """Return the text, which must not be empty: nothing is meant by leaving it out."""
        if not str(value).replace(self._separator or ' ', '').strip():
            self.fail(f'{value!r} names nothing; leave it out for the default', param, ctx)
        return value

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str
                       ) -> list[CompletionItem]:
        """Return the words that begin so."""
        before, between, last = incomplete.rpartition(self._separator) if (
            self._separator) else ('', '', incomplete)
        found = [CompletionItem(f'{before}{between}{word}{self._ending}')
                 for word in self._known() if word.startswith(last)]
        return [CompletionItem(incomplete, type='file')] if self._files and not found else found


def _effects() -> list[str]:
    from lg_husky_sim.husky.effects import catalogue
    return list(catalogue())


def _parameters() -> list[str]:
    from lg_husky_sim.husky.effects import catalogue
    from lg_husky_sim.husky.model_file import load_model
    return [*load_model().parameters,
            *(p.name for kind in catalogue().values() for p in kind.parameters)]


def _manoeuvres() -> list[str]:
    from lg_husky_sim.manoeuvres import builtin_manoeuvres
    return list(builtin_manoeuvres())


def _nuisances() -> list[str]:
    from lg_husky_sim.identification.start_states import INITIAL_STATE
    from lg_husky_sim.identification.unknowns import NUISANCES as KNOWN
    return [*KNOWN, INITIAL_STATE]


def _roles() -> list[str]:
    from dataclasses import fields

    from lg_husky_sim.recording import TopicMap
    return [field.name for field in fields(TopicMap)]


class Place(click.Path):
    """A path that is not empty, which would be the folder that one is in."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None
                ) -> Any:
        """Return the path."""
        if not str(value).strip():
            self.fail(f'{value!r} names no file or folder', param, ctx)
        return super().convert(value, param, ctx)


#: A recording: a file or folder.
RECORDING = Place()
EFFECT = Words(_effects)
EFFECTS = Words(_effects, ',')
PARAMETERS = Words(_parameters, ',')
NUISANCES = Words(_nuisances, ',')
SETTING = Words(_parameters, ending='=')
TOPIC = Words(_roles, ending='=')
COMMANDS = Words(_manoeuvres, files=True)
MODEL = Place(path_type=Path)


def _topics(context: click.Context, _: click.Parameter, given: tuple[str, ...]) -> TopicMap:
    from lg_husky_sim.errors import RecordingError
    from lg_husky_sim.recording import TopicMap
    try:
        return TopicMap.parse(given)
    except RecordingError as error:
        raise click.UsageError(str(error), context) from error


def _settings(context: click.Context, _: click.Parameter, given: tuple[str, ...]
              ) -> dict[str, float]:
    from lg_husky_sim.errors import ParameterError
    from lg_husky_sim.husky.model_file import parse_settings
    try:
        return parse_settings(given)
    except ParameterError as error:
        raise click.UsageError(str(error), context) from error


def topics_option(function: Function) -> Function:
    """Add ``--topic``; the verb gets a ``TopicMap``."""
    return click.option(
        '--topic', 'topics', multiple=True, metavar='ROLE=NAME […]', type=TOPIC, callback=_topics,
        help='Choose a topic or frame of the recordings by hand (command=/cmd_vel, …).',
    )(function)


def settings_option(function: Function) -> Function:
    """Add ``--set``; the verb gets a dict of floats."""
    return click.option(
        '--set', 'settings', multiple=True, metavar='NAME=VALUE […]', type=SETTING,
        callback=_settings,
        help='Override physical parameters.')(function)


def model_option(*flags: str) -> Callable[[Function], Function]:
    """Add an option for a model file."""
    def decorate(function: Function) -> Function:
        return click.option(
            *flags, type=MODEL, metavar='FILE.yaml',
            help="Model file; the Husky with the paper's parameters by default.")(function)
    return decorate
