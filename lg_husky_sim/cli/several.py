# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Options that take one word or several.

`--baseline a b c` says the same as `--baseline a --baseline b --baseline c`.
"""

from __future__ import annotations

from collections.abc import Iterator
import re

import click

#: What an option of settings can take: a name, then its value.
SETTING = re.compile(r'[A-Za-z_][\w.]*=')


class SeveralWords(click.Command):
    """
    A command of which some repeatable options also take several words after one flag.

    It is those with a ``…`` in their metavar. If there is a ``=`` in it, too, they go on as long
    as words look like settings; the others up to the next option, unless nothing would be left
    for the arguments that the command needs: then one word belongs to each flag. One flag before
    three words or more is refused, since nobody knows where its own end; so are several of which
    another than the last has more than one.
    """

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        words, arguments = self._spelt_out(args, True)
        needed = next((one for one in self.params
                       if isinstance(one, click.Argument) and one.required), None)
        if needed is not None and not arguments:
            alone, arguments = self._spelt_out(args, False)
            flags = [word for word in alone if self._goes_on(word)]
            if flags and arguments > 1 and (
                    len(flags) == 1 or self._after_each(args) != [1] * (len(flags) - 1)):
                raise click.UsageError(
                    f'all words follow {flags[0]}, which takes several: put '
                    f'{needed.metavar or needed.name} before it, or after --', ctx)
            words = alone
        return super().parse_args(ctx, words)

    def _goes_on(self, word: str) -> bool:
        # Whether it is a flag that takes whatever words follow.
        return any('…' in (shown := one.metavar or '') and '=' not in shown
                   for one in self.params if isinstance(one, click.Option) and word in one.opts)

    def _after_each(self, args: list[str]) -> list[int]:
        # How many words follow each of such flags but the last.
        counts: list[int] = []
        open_ = False
        for word in args:
            if word.startswith('-'):
                open_ = self._goes_on(word)
                counts += [0] * open_
            elif open_:
                counts[-1] += 1
        return counts[:-1]

    def _spelt_out(self, args: list[str], greedy: bool) -> tuple[list[str], int]:
        # The words with a flag before each value, and how many belong to no option.
        options = {name: one for one in self.params if isinstance(one, click.Option)
                   for name in (*one.opts, *one.secondary_opts)}
        words: list[str] = []
        arguments = 0
        rest = iter(args)
        for word in rest:
            words.append(word)
            option = options.get(word)
            if word == '--':
                behind = list(rest)
                arguments += len(behind)
                words += behind
            elif option is not None and not (option.is_flag or option.count):
                words += _first(rest)
            elif not word.startswith('-'):
                several = _owner(words[:-1], options, word, greedy)
                if several is None:
                    arguments += 1
                else:
                    words[-1:] = [several, word]
        return words, arguments


def _first(rest: Iterator[str]) -> list[str]:
    word = next(rest, None)
    return [] if word is None else [word]


def _owner(before: list[str], options: dict[str, click.Option], word: str, greedy: bool
           ) -> str | None:
    # The flag of a repeatable option whose value stands just before this word.
    option = options.get(before[-2]) if len(before) > 1 else None
    shown = '' if option is None else option.metavar or ''
    if '…' not in shown:
        return None
    return before[-2] if (SETTING.match(word) if '=' in shown else greedy) else None
