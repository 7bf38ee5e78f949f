# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Run a blind trial: generate and seal, diagnose by the command line, open and score."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
import json
from pathlib import Path
import shutil
import signal
import subprocess
import sys
import time
from typing import Any

from lg_husky_sim.errors import CommandError, LgHuskyError, RecordingError
from lg_husky_sim.parallel import map_tasks
from lg_husky_sim.proof import bags, measures, outcomes, plain
from lg_husky_sim.proof.cases import generate, NoTraceError, Spec
from lg_husky_sim.proof.sealing import unseal, write_json

TRIES = 100
"""Draws of one robot before a seed is given up."""

REDRAWN = 1_000_003
"""Distance between the seeds of two draws."""

TIME_LIMIT = 900.0
INTERRUPTED = (130, -signal.SIGINT, -signal.SIGTERM)
"""Exit codes of a command that was told to stop: it has no outcome, and is run again."""

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Folders:
    """
    Where a trial keeps its parts; a diagnosis is given paths below `cases` only.

    `cases_of`: another folder with `cases` and `answers` that somebody else has made.
    """

    root: Path
    cases_of: Path | None = None

    def absolute(self) -> Folders:
        """Return the same folders for a process that may work in another one."""
        return Folders(self.root.absolute(), self.cases_of and self.cases_of.absolute())

    @property
    def cases(self) -> Path:
        """Return where the recordings are, one folder a case."""
        return (self.cases_of or self.root) / 'cases'

    @property
    def answers(self) -> Path:
        """Sealed answers."""
        return (self.cases_of or self.root) / 'answers'

    @property
    def held_out(self) -> Path:
        """Return where the recordings are that no diagnosis is given."""
        return self.root / 'held_out'

    @property
    def runs(self) -> Path:
        """Return where the files are that the diagnoses wrote."""
        return self.root / 'runs'

    @property
    def commitments(self) -> Path:
        """Return the file of the commitments to the answers."""
        return self.root / 'commitments.json'

    @property
    def outcomes(self) -> Path:
        """One JSON line a case."""
        return self.root / 'outcomes.jsonl'


def name_of(index: int) -> str:
    """Return the name of case number `index`, counted from zero."""
    return f'case_{index + 1:04d}'


def keep_plan(folders: Folders, specs: Sequence[Spec]) -> None:
    """
    Write the plan, or check that the folder holds this very trial (so that it resumes).

    Raises
    ------
    CommandError
        The folder holds another trial.

    """
    path = folders.root / 'plan.json'
    plan = json.loads(json.dumps([asdict(spec) for spec in specs]))
    if path.exists():
        if json.loads(path.read_text(encoding='utf-8')) != plan:
            raise CommandError(f'{folders.root} holds another trial; choose an empty folder')
        return
    write_json(path, plan)


def _generate(case: tuple[Spec, str], folders: Folders, held_out: bool) -> tuple[str, str]:
    spec, name = case
    for again in range(TRIES):
        try:
            return name, generate(
                replace(spec, seed=spec.seed + again * REDRAWN), name, folders.cases,
                folders.answers, folders.held_out if held_out else None)
        except (FloatingPointError, NoTraceError) as error:
            # This draw drives the robot out of its bounds, or its drives cannot show the effect:
            # take the next, the same for everyone; another effect where none can be seen.
            if isinstance(error, NoTraceError) and again % 5 == 4:
                spec = replace(spec, effects=(), onset='')
            for place in (folders.cases, folders.held_out):
                shutil.rmtree(place / name, ignore_errors=True)
    raise CommandError(f'seed {spec.seed} gives no robot that stays in its bounds '
                       'and shows its effect')


def prepare(folders: Folders, specs: Sequence[Spec], jobs: int, done: Progress,
            held_out: bool = True) -> dict[str, str]:
    """
    Generate and seal all cases that are not there yet; return the commitments by case.

    The cases of one trial are all sealed before the first is diagnosed.
    """
    sealed: dict[str, str] = {}
    if folders.commitments.exists():
        sealed = json.loads(folders.commitments.read_text(encoding='utf-8'))
    missing = [(spec, name_of(k)) for k, spec in enumerate(specs)
               if name_of(k) not in sealed]
    for _ in range(len(specs) - len(missing)):
        done('')
    if not missing:
        return sealed
    for name, commitment in _made(folders, missing, jobs, held_out):
        sealed[name] = commitment
        write_json(folders.commitments, sealed)
        done(name)
    return sealed


def _made(folders: Folders, missing: Sequence[tuple[Spec, str]], jobs: int,
          held_out: bool) -> Iterator[tuple[str, str]]:
    """Generate cases; yield names and commitments."""
    make = partial(_generate, folders=folders.absolute(), held_out=held_out)
    yield from map_tasks(make, missing, jobs)


def command_for(folders: Folders, name: str, out: Path, told: Mapping[str, Any]) -> list[str]:
    """
    Return the command line that diagnoses one case; it names recordings and two lengths.

    A case may have a model of its robot, `robot.yaml`.

    Parameters
    ----------
    folders, name
        The case.
    out
        Where the diagnosis writes.
    told
        'wheel_radius_m' and 'track_m', as measured with a ruler.

    """
    case = folders.cases / name
    before = sorted((case / 'before').glob('rec*')) if (case / 'before').is_dir() else []
    given = sorted((case / 'after' if before else case).glob('rec*'))
    command = [sys.executable, '-m', 'lg_husky_sim.cli.main', 'diagnose', *map(str, given),
               '--out', str(out), '--seed', '1', '--jobs', '1', '--no-report',
               '--set', f'wheel_radius={told["wheel_radius_m"]}',
               '--set', f'track={told["track_m"]}']
    if (model := case / 'robot.yaml').is_file():
        command += ['--robot', str(model)]
    for path in before:
        command += ['--baseline', str(path)]
    return command


def _run(command: list[str]) -> tuple[int, str]:
    """
    Run a command; return its exit code and the last line of its standard error.

    Raises
    ------
    CommandError
        It was interrupted.

    """
    try:
        done = subprocess.run(  # noqa: S603 (our own command line)
            command, capture_output=True, text=True, timeout=TIME_LIMIT, check=False)
    except subprocess.TimeoutExpired:
        return -1, f'no answer within {TIME_LIMIT:.0f} s'
    if done.returncode in INTERRUPTED:
        raise CommandError('interrupted; the same command goes on from here')
    lines = done.stderr.strip().splitlines()
    return done.returncode, lines[-1] if lines else ''


def diagnose(folders: Folders, name: str) -> dict[str, Any]:
    """
    Diagnose one case blindly, drive its model on held-out commands, and measure.

    Returns
    -------
    dict
        'case', 'exit_code', 'error' (one line or ''), 'seconds', 'diagnosis' (the file's content
        or None) and 'held_out': for each held-out recording the errors of the 'plain'
        refitted paper model, the 'augmented' model and the 'truth' (`measures.errors`).

    """
    out = folders.runs / name
    path = out / 'outcome.json'
    if path.exists():
        outcome: dict[str, Any] = json.loads(path.read_text(encoding='utf-8'))
        return outcome
    out.mkdir(parents=True, exist_ok=True)
    work = out / 'diagnosis'
    if work.exists():
        shutil.rmtree(work)
    # What a ruler says of a robot is no secret; nothing else of the answer is read here.
    told = json.loads((folders.answers / f'{name}.json').read_text(encoding='utf-8'))['robot']
    start = time.monotonic()
    code, error = _run(command_for(folders, name, work, told))
    seconds = time.monotonic() - start
    diagnosis = None
    if code == 0:
        try:
            diagnosis = json.loads((work / 'diagnosis.json').read_text(encoding='utf-8'))
            error = ''
        except (OSError, ValueError) as problem:
            error = f'diagnosis.json cannot be read: {problem}'
    error = error or (f'exit code {code}' if code else '')
    outcome = {'case': name, 'exit_code': code, 'error': error, 'seconds': seconds,
               'diagnosis': diagnosis, 'held_out': []}
    if diagnosis is not None and (folders.held_out / name).is_dir():
        outcome['held_out'], problem_line = _hold_out(folders, name, work / 'model.yaml')
        outcome['held_out_error'] = problem_line
    write_json(path, outcome)
    return outcome


def _hold_out(folders: Folders, name: str, model: Path) -> tuple[list[Any], str]:
    """Return the errors on each held-out recording, and why there are none."""
    try:
        return _measured(folders, name, model)
    except RecordingError as error:
        return [], str(error)


def _measured(folders: Folders, name: str, model: Path) -> tuple[list[Any], str]:
    train = [bags.read_bag(path) for path in sorted((folders.cases / name).glob('rec*'))]
    parameters = plain.calibrate(train)
    rows = []
    for held in sorted((folders.held_out / name).glob('held*')):
        driven = folders.runs / name / f'{held.name}_model'
        code, error = _run([sys.executable, '-m', 'lg_husky_sim.cli.main', 'simulate',
                            '--model', str(model), '--commands', str(held),
                            '--out', str(driven), '--overwrite'])
        if code != 0:
            return [], f'simulate: {error}'
        measured = bags.read_bag(held)
        truth = bags.read_bag(held.with_name(held.name.replace('held', 'truth')))
        rows.append({
            'recording': held.name,
            'plain': measures.errors(plain.simulate(parameters, measured), measured),
            'augmented': measures.errors(bags.read_bag(driven), measured),
            'truth': measures.errors(truth, measured)})
        shutil.rmtree(driven)
    return rows, ''


def diagnose_all(folders: Folders, names: Sequence[str], jobs: int) -> Iterator[dict[str, Any]]:
    """Diagnose cases on `jobs` cores at once, or on a cluster; yield outcomes in order."""
    # Threads here: each waits for a process of its own, which hears Ctrl-C.
    yield from map_tasks(partial(diagnose, folders.absolute()), names, jobs, threads=True)


def diagnosed(folders: Folders, names: Sequence[str]) -> list[str]:
    """
    Return the cases that have an outcome.

    Raises
    ------
    LgHuskyError
        None has.

    """
    done = [name for name in names if (folders.runs / name / 'outcome.json').exists()]
    if not done:
        raise LgHuskyError(f'no case in {folders.root} is diagnosed yet')
    return done


def opened(folders: Folders, sealed: Mapping[str, str],
           names: Sequence[str]) -> list[dict[str, Any]]:
    """
    Open the answers, check each against its commitment, and return the outcomes' lines.

    Raises
    ------
    LgHuskyError
        An answer was changed, or a case has no outcome yet.

    """
    result = []
    for name in names:
        path = folders.runs / name / 'outcome.json'
        if not path.exists():
            raise LgHuskyError(f'{name} has no outcome yet')
        answer = unseal(folders.answers / f'{name}.json', sealed[name])
        result.append(outcomes.line_of(answer, json.loads(path.read_text(encoding='utf-8'))))
    return result


def given(cases_of: Path) -> tuple[dict[str, str], str]:
    """
    Return the commitments of cases that are there already, and which set they are.

    Opened cases of others are 'validation', those of this generator 'tuning'.

    Raises
    ------
    LgHuskyError
        The folder has no such cases.

    """
    from lg_husky_sim.proof.sealing import commitment
    try:
        answers = {path.stem: json.loads(path.read_text(encoding='utf-8'))
                   for path in sorted((cases_of / 'answers').glob('*.json'))
                   if (cases_of / 'cases' / path.stem).is_dir()}
    except (OSError, ValueError) as error:
        raise LgHuskyError(f'{cases_of}: an answer cannot be read: {error}') from error
    if not answers:
        raise LgHuskyError(f'{cases_of} has no cases with answers (cases/ID, answers/ID.json)')
    ours = all('spec' in answer for answer in answers.values())
    return ({name: commitment(answer) for name, answer in answers.items()},
            'tuning' if ours else 'validation')


def commit() -> str:
    """Return the commit of the source tree that is tried, or the version of what is installed."""
    from importlib.metadata import PackageNotFoundError, version
    root = Path(__file__).resolve().parents[2]
    git = shutil.which('git')
    if git is not None and (root / '.git').exists():
        asked = subprocess.run(  # noqa: S603 (our own command line)
            [git, '-C', str(root), 'describe', '--always', '--dirty', '--abbrev=12'],
            capture_output=True, text=True, check=False)
        if asked.returncode == 0:
            return asked.stdout.strip()
    try:
        return f'version {version("lg_husky_sim")}'
    except PackageNotFoundError:
        return 'unknown'
