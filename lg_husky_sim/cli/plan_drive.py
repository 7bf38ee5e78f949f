# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky plan-drive`: plan the drive that tells two explanations apart."""

from __future__ import annotations

import itertools
import os
from pathlib import Path
from typing import TYPE_CHECKING

import click
from lg_husky_sim.cli.common import misused, Output, spoken

if TYPE_CHECKING:
    from lg_husky_sim.diagnosis.planning import Rival
    from lg_husky_sim.manoeuvres import Manoeuvre


@click.command(short_help='Find the drive that best distinguishes two explanations.')
@click.argument('folder', required=False, type=click.Path(path_type=Path), metavar='[DIR]')
@click.option('--effects', metavar='A,B',
              help='Two ids of the catalogue, at typical sizes, instead of a diagnosis; '
                   'with a side if need be (coulomb_drivetrain:left).')
@click.option('--robot', '--model', 'robot', type=click.Path(path_type=Path),
              metavar='FILE.yaml',
              help="Model that --effects are added to; the Husky with the paper's parameters by "
                   'default.')
@click.option('--out', required=True, type=click.Path(path_type=Path), metavar='SCRIPT.yaml',
              help='Command script of the best drive, for simulate and drive.')
@click.option('--max-speed', metavar='M/S', type=click.FloatRange(min=0.0, min_open=True),
              help='Highest speed of a drive; 0.8 m/s by default, and less for a robot that is '
                   'slower than a Husky.')
@click.option('--max-yaw', metavar='RAD/S', type=click.FloatRange(min=0.0, min_open=True),
              help='Highest yaw rate of a drive; 0.8 rad/s by default, likewise.')
@spoken()
def command(folder: Path | None, effects: str | None, robot: Path | None, out: Path,
            max_speed: float | None, max_yaw: float | None, say: Output) -> None:
    """
    Write the drive that best distinguishes the first two explanations of a diagnosis.

    DIR is the folder of a diagnosis. Each explanation is simulated on a list of drives and
    the other one is refitted to it; the best drive is that on which neither can imitate the other.
    """
    from lg_husky_sim.api.tables import Table
    from lg_husky_sim.diagnosis.planning import drives, plan, usual_speeds
    from lg_husky_sim.diagnosis.settings import setting
    from lg_husky_sim.errors import SettingsError
    from lg_husky_sim.folders import check_unchanged, check_writable
    from lg_husky_sim.manoeuvres import SCHEMA

    if (folder is None) == (effects is None):
        raise misused('give either the folder of a diagnosis or --effects A,B')
    if out.is_dir() or not out.resolve().parent.is_dir():
        raise SettingsError(f'cannot write {out}: it must be a file in an existing folder')
    check_unchanged(out, f'schema: {SCHEMA}')
    check_writable(out)
    one, two = _from_folder(folder) if folder is not None else _from_ids(effects or '', robot)
    speed, rate = usual_speeds(one.parameters)
    candidates = drives(max_speed or speed, max_yaw or rate)
    with say.stages() as report:
        done = itertools.count(1)
        ranked = plan(one, two, candidates,
                      lambda: report('drives', next(done) / len(candidates)))
    best = ranked[0]
    _write(out, best.manoeuvre, f'{best.manoeuvre.about}; tells {one.name} and {two.name} apart '
                                f'by {best.nats:.0f} nats')
    title = (f'{one.name} against {two.name}: expected evidence from one recording of each '
             'drive, whichever of the two is true')
    say.result(Table(title, ('drive', 'length [s]', 'evidence [nats]', 'best channel'), tuple(
        (row.manoeuvre.name, row.manoeuvre.duration, row.nats, row.channel) for row in ranked)),
        [{'drive': row.manoeuvre.name, 'length_s': row.manoeuvre.duration,
          'evidence_nats': row.nats, 'channel': row.channel} for row in ranked])
    say.written(out, f': {best.manoeuvre.name}, {best.manoeuvre.about}')
    if best.nats < setting('decisive'):
        say.remark('None of these drives is decisive: another sensor or a higher speed is needed.')


def _from_ids(text: str, robot: Path | None) -> tuple[Rival, Rival]:
    from lg_husky_sim.diagnosis.planning import typical
    from lg_husky_sim.husky.model_file import load_model
    names = [part.strip() for part in text.split(',')]
    if len(names) != 2 or not all(names) or names[0] == names[1]:
        raise misused(f'--effects {text!r}: expected two different ids, such as '
                      'yaw_scrub_coulomb,terrain_change')
    model = load_model(robot).in_proportion()
    one, two = (typical(name, model.structure, model.parameters, side)
                for name, _, side in (part.partition(':') for part in names))
    return one, two


def _from_folder(folder: Path) -> tuple[Rival, Rival]:
    import json

    from lg_husky_sim.diagnosis.planning import Rival, typical
    from lg_husky_sim.errors import SettingsError
    from lg_husky_sim.husky.model_file import load_model
    place = folder / 'diagnosis.json'
    if not place.is_file():
        raise SettingsError(f'{folder} is not the folder of a diagnosis: it has no diagnosis.json')
    try:
        data = json.loads(place.read_text(encoding='utf-8'))
        finding = data['findings'][0] if data['findings'] else None
        rivals = [(str(r['effect']), str(r['side'])) for r in finding['rivals']] if finding else []
        name = str(finding['effect']) if finding else ''
    except (ValueError, KeyError, TypeError, IndexError, RecursionError) as error:
        raise SettingsError(f'{place} is not a diagnosis: {error}') from error
    rivals = [(effect, side) for effect, side in rivals if effect != name]
    if not finding or name == 'unknown' or not rivals:
        raise SettingsError(
            f'{place} names no effect with a competing one, so there is nothing to distinguish')
    plain, model = (load_model(folder / name).in_proportion()
                    for name in ('plain.yaml', 'model.yaml'))
    first = next((e for e in model.structure.effects
                  if e.id == name and e not in plain.structure.effects), None)
    if first is None:
        raise SettingsError(f'{place} names {name}, but {folder / "model.yaml"} does not add it '
                            'to plain.yaml: these files are not from one diagnosis')
    found = typical(name, plain.structure, model.parameters, first.side)
    numbers = {p.name: model.parameters[p.name] for p in first.parameters()}
    one = Rival(name, found.structure, found.parameters.replacing(numbers), (numbers,))
    effect, side = rivals[0]
    return one, typical(effect, plain.structure, plain.parameters,
                        '' if side == 'none' else side)


def _write(out: Path, manoeuvre: Manoeuvre, about: str) -> None:
    from lg_husky_sim.folders import scratch_beside, signed
    from lg_husky_sim.manoeuvres import SCHEMA
    from lg_husky_sim.yaml_files import yaml_text
    data = {'schema': SCHEMA, 'about': about, 'rate': manoeuvre.rate, 'steps': [
        {'duration': round(s.duration, 3), 'forward': round(s.forward, 4),
         'yaw': round(s.yaw, 4), 'ramp': round(s.ramp, 3)} for s in manoeuvre.steps]}
    with scratch_beside(out) as scratch:
        draft = scratch / 'script.yaml'
        draft.write_text(signed(yaml_text(data, flow=None)), encoding='utf-8')
        os.replace(draft, out)
