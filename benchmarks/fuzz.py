# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Damage what is read, and see that it is refused in one line or makes sense.

Usage: ``python benchmarks/fuzz.py [--seconds 600] [--inputs N] [--seed 1] [--only NAME ...]``.
Every input follows from seed, reader and number. What fails is kept in ``fuzz_failures/``: an
exception of another kind than a refusal, a crash, more than 10 s, more than 2 GB, or a reading
that makes no sense. Exit code 1 then.
"""

from __future__ import annotations

import argparse
import contextlib
from dataclasses import dataclass, field
import io
import json
import os
from pathlib import Path
import random
import re
import resource
import shutil
import signal
import sys
import time
import traceback
from types import FrameType
import warnings

from fuzz_readers import prepared, Reader, READERS

#: Longest time of one input [s], and most memory beyond what the process has at the start [MB].
LONGEST, LARGEST = 10.0, 2000.0
FAILURES = Path('fuzz_failures')
#: Failures of a reader that are kept.
MOST = 20
NUMBERS = (0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF,
           0x7FFFFFFFFFFFFFFF, 0xFFFFFFFFFFFFFFFF)
WORDS = ('', 'null', 'true', '-1', '0', '1e400', '-1e308', '1e-320', '.nan', '-.inf', '{}', '[]',
         '[[[[', '{a: {b', '&a [*a]', '*a', '!!python/object/apply:os.system [true]', '"\\0"',
         'x' * 3000, '9' * 400, '../../etc/passwd', 'é\u202e', '12:30:45', '0x7f', '- -', '? :',
         '<<: {}', '%YAML 1.1', '---', '\t', '1_000', "'", '2026-01-01', 'value', '1/0',
         '2**2**99', '10**10**10', 'a*b')


def damaged_bytes(data: bytes, draw: random.Random) -> bytes:
    """Return an input with some bytes flipped, cut, moved, repeated or replaced."""
    out = bytearray(data)
    for _ in range(1 + int(draw.expovariate(0.5))):
        size = max(len(out), 1)
        at = draw.randrange(size)
        until = min(size, at + 1 + int(draw.expovariate(1.0 / 24.0)))
        match draw.randrange(8):
            case 0 | 1:
                if out:
                    out[at] ^= 1 << draw.randrange(8)
            case 2:
                width = draw.choice((1, 2, 4, 8))
                number = draw.choice(NUMBERS) & (1 << 8 * width) - 1
                out[at:at + width] = number.to_bytes(width, draw.choice(('little', 'big')))
            case 3:
                del out[at:until]
            case 4:
                out[at:at] = out[at:until]
            case 5:
                out[at:until] = draw.randbytes(until - at)
            case 6:
                other = draw.randrange(size)
                out[at:until] = out[other:other + until - at]
            case _:
                if draw.random() < 0.2:
                    del out[at:]
    return bytes(out)


def damaged_text(data: bytes, draw: random.Random) -> bytes:
    """Return a text with words or lines replaced, moved, repeated or left out."""
    text = data.decode(errors='surrogateescape')
    for _ in range(1 + int(draw.expovariate(0.7))):
        lines = text.splitlines(keepends=True) or ['']
        at, other = draw.randrange(len(lines)), draw.randrange(len(lines))
        match draw.randrange(7):
            case 0:
                del lines[at]
            case 1:
                lines.insert(at, lines[other])
            case 2:
                lines[at], lines[other] = lines[other], lines[at]
            case 3:
                lines[at] = '  ' * draw.randrange(4) + lines[at].lstrip()
            case _:
                words = list(re.finditer(r'[^\s,:\[\]{}]+', lines[at]))
                if words:
                    word = draw.choice(words)
                    new = draw.choice(WORDS) if draw.random() < 0.7 else draw.choice(
                        re.findall(r'[^\s,:\[\]{}]+', text) or [''])
                    lines[at] = lines[at][:word.start()] + new + lines[at][word.end():]
        text = ''.join(lines)
    return text.encode(errors='surrogateescape')


def mutant(reader: Reader, seeds: list[bytes], seed: int, number: int) -> bytes:
    """Return the input of that number; number 0 and so on are the sound ones."""
    if number < len(seeds):
        return seeds[number]
    draw = random.Random(f'{seed}/{reader.name}/{number}')
    data = draw.choice(seeds)
    if reader.text and draw.random() < 0.7:
        return damaged_text(data, draw)
    return damaged_bytes(data, draw)


@dataclass
class Tally:
    """What became of a reader's inputs."""

    inputs: int = 0
    refused: int = 0
    slowest: float = 0.0
    memory: float = 0.0
    failures: list[str] = field(default_factory=list)


class TooLongError(BaseException):
    """An input took longer than it may; no handler of a reader may swallow it."""


def _too_long(number: int, frame: FrameType | None) -> None:
    raise TooLongError


def attempt(reader: Reader, data: bytes, folder: Path, tally: Tally) -> str:
    """Read one input; return what is wrong, or nothing."""
    begun = time.process_time()
    signal.setitimer(signal.ITIMER_VIRTUAL, LONGEST)
    problem = ''
    try:
        with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
            warnings.simplefilter('ignore')
            reader.read(data, folder)
    except reader.refusals:
        tally.refused += 1
    except TooLongError:
        problem = f'took more than {LONGEST:g} s'
    except (Exception, RecursionError):
        problem = traceback.format_exc()
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
    tally.inputs += 1
    tally.slowest = max(tally.slowest, time.process_time() - begun)
    return problem


def _peak() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def worker(reader: Reader, seed: int, first: int, inputs: int, seconds: float, out: int) -> None:
    """Try inputs until they or the time are used up; say the number of each before it."""
    signal.signal(signal.SIGVTALRM, _too_long)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    # Beyond what counts as a failure; the machine has others to serve.
    most = round((LARGEST + 2000.0) * 1e6)
    resource.setrlimit(resource.RLIMIT_DATA, (most, most))
    tally, number = Tally(), first
    folder, seeds = prepared(reader)
    before = _peak()
    end = time.process_time() + seconds
    said = 0.0
    while number < inputs and time.process_time() < end:
        data = mutant(reader, seeds, seed, number)
        os.write(out, f'{number}\n'.encode())
        problem = attempt(reader, data, folder, tally)
        memory = _peak() - before
        if memory > LARGEST and tally.memory <= LARGEST:
            problem = problem or f'took {memory:.0f} MB'
        tally.memory = max(tally.memory, memory)
        if problem and len(tally.failures) < MOST:
            FAILURES.mkdir(exist_ok=True)
            stem = FAILURES / f'{reader.name.replace(" ", "_").replace(",", "")}-{number}'
            stem.with_suffix('.input').write_bytes(data)
            stem.with_suffix('.txt').write_text(problem, encoding='utf-8')
            tally.failures.append(f'{number}: {problem.strip().splitlines()[-1][:160]}')
        number += 1
        if time.monotonic() - said > 0.2 or number >= inputs or time.process_time() >= end:
            said = time.monotonic()
            line = json.dumps(vars(tally)) + '\n'
            os.write(out, line.encode())
    shutil.rmtree(folder)


def run(reader: Reader, seed: int, inputs: int, seconds: float) -> Tally:
    """Run a reader's inputs in a process of its own; one that dies is a failure, and goes on."""
    whole, first, left = Tally(), 0, seconds
    while first < inputs and left > 0.0:
        begun = time.monotonic()
        source, sink = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(source)
            try:
                worker(reader, seed, first, inputs, left, sink)
            except BaseException:
                traceback.print_exc()
                os._exit(70)
            os._exit(0)
        os.close(sink)
        with os.fdopen(source) as lines:
            said, now = '', first
            for line in lines:
                if line.startswith('{'):
                    said = line
                else:
                    now = int(line)
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        state = json.loads(said) if said else vars(Tally())
        whole.inputs += state['inputs']
        whole.refused += state['refused']
        whole.slowest = max(whole.slowest, state['slowest'])
        whole.memory = max(whole.memory, state['memory'])
        whole.failures += state['failures']
        if code == 0:
            break
        whole.failures.append(f'{now}: the process ended with {code}')
        if code == 70 or len(whole.failures) > MOST:
            break
        first = now + 1
        left -= time.monotonic() - begun
    return whole


def main() -> int:
    """Print one line for each reader; return 1 if anything failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seconds', type=float, default=600.0, help='of processor, altogether')
    parser.add_argument('--inputs', type=int, default=10**9, help='for each reader, at most')
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--only', nargs='*', default=[], help='readers whose names begin so')
    words = parser.parse_args()
    chosen = [one for one in READERS if not words.only or one.name.startswith(tuple(words.only))]
    shares = sum(one.share for one in chosen)
    print('| reader | inputs | refused | read | slowest | memory | failures |')
    print('| --- | --- | --- | --- | --- | --- | --- |')
    total = failed = 0
    for reader in chosen:
        one = run(reader, words.seed, words.inputs, words.seconds * reader.share / shares)
        total, failed = total + one.inputs, failed + len(one.failures)
        print(f'| {reader.name} | {one.inputs:,} | {one.refused:,} | '
              f'{one.inputs - one.refused - len(one.failures):,} | {one.slowest:.2f} s | '
              f'{one.memory:.0f} MB | {len(one.failures)} |', flush=True)
        for text in one.failures:
            print(f'    {reader.name}, input {text}', file=sys.stderr)
    print(f'| **all** | **{total:,}** |  |  |  |  | **{failed}** |')
    return 1 if failed else 0


if __name__ == '__main__':
    sys.exit(main())
