# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A folder of results appears whole, replaces only its like, and leaves nothing behind."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import lg_husky_sim as lg
from lg_husky_sim.cli.main import run
from lg_husky_sim.diagnosis.planning import Separation
from lg_husky_sim.errors import SettingsError
from lg_husky_sim.folders import check_folder, check_ours, result_folder, signed
from lg_husky_sim.identification.report import report_paths
from lg_husky_sim.manoeuvres import find_manoeuvre
from lg_husky_sim.manoeuvres import SCHEMA as COMMANDS
import pytest


def _fill(path: Path, name: str, content: str = 'x') -> None:
    with result_folder(path, 'result.json') as folder:
        (folder / 'result.json').write_text(content)
        (folder / name).write_text(content)


def test_results_appear_and_are_replaced(tmp_path: Path) -> None:
    out = tmp_path / 'deep' / 'out'
    _fill(out, 'first.png')
    _fill(out, 'second.png', 'y')
    assert {path.name for path in out.iterdir()} == {
        'result.json', 'second.png', '.result.json.files'}
    assert (out / 'result.json').read_text() == 'y'
    assert [path.name for path in out.parent.iterdir()] == ['out']


def test_an_empty_folder_is_taken(tmp_path: Path) -> None:
    _fill(tmp_path / 'out', 'a')
    (tmp_path / 'empty').mkdir()
    _fill(tmp_path / 'empty', 'a')
    assert (tmp_path / 'empty' / 'result.json').is_file()


def test_a_failure_keeps_the_old_results(tmp_path: Path) -> None:
    out = tmp_path / 'out'
    _fill(out, 'first.png')

    def interrupted() -> None:
        with result_folder(out, 'result.json') as folder:
            (folder / 'result.json').write_text('half')
            raise KeyboardInterrupt
    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert (out / 'result.json').read_text() == 'x'
    assert [path.name for path in tmp_path.iterdir()] == ['out']


def test_what_is_not_ours_stays(tmp_path: Path) -> None:
    out = tmp_path / 'thesis'
    (out / 'chapter').mkdir(parents=True)
    (out / 'thesis.tex').write_text('mine')
    (out / 'chapter' / 'one.tex').write_text('mine')
    (out / 'a').write_text('mine too')
    (out / 'a~').write_text('an older one of mine')
    for content in ('first', 'second'):
        _fill(out, 'a', content)
        assert (out / 'thesis.tex').read_text() == 'mine'
        assert (out / 'chapter' / 'one.tex').read_text() == 'mine'
        assert (out / 'a').read_text() == content
        assert (out / 'a~').read_text() == 'an older one of mine'
        assert (out / 'a~~').read_text() == 'mine too'
    _fill(out, 'b')
    assert {path.name for path in out.iterdir() if not path.name.startswith('.')} == {
        'thesis.tex', 'chapter', 'a~', 'a~~', 'b', 'result.json'}


def test_an_open_log_in_the_folder_goes_on(tmp_path: Path) -> None:
    out = tmp_path / 'out'
    out.mkdir()
    with (out / 'log.txt').open('w') as log:
        log.write('before ')
        _fill(out, 'a')
        log.write('after')
    assert (out / 'log.txt').read_text() == 'before after'


def test_a_folder_among_the_results_is_replaced_whole(tmp_path: Path) -> None:
    for name in ('one', 'two'):
        with result_folder(tmp_path / 'out', 'result.json') as folder:
            (folder / 'result.json').write_text(name)
            (folder / 'parts').mkdir()
            (folder / 'parts' / name).write_text('x')
    assert [path.name for path in (tmp_path / 'out' / 'parts').iterdir()] == ['two']


def test_a_list_of_results_reaches_no_farther_than_its_folder(tmp_path: Path) -> None:
    out = tmp_path / 'out'
    _fill(out, 'a')
    (tmp_path / 'near').write_text('mine')
    (out / '.result.json.files').write_text('../near\n..\n.\n\na\n')
    _fill(out, 'b')
    assert (tmp_path / 'near').read_text() == 'mine'
    assert not (out / 'a').exists()


def test_results_go_into_no_file_and_no_recording(tmp_path: Path) -> None:
    (tmp_path / 'file').write_text('mine')
    with pytest.raises(SettingsError, match='file exists and is not a folder'):
        check_folder(tmp_path / 'file')
    (tmp_path / 'bag').mkdir()
    (tmp_path / 'bag' / 'metadata.yaml').write_text('mine')
    with pytest.raises(SettingsError, match='bag is a recording'):
        _fill(tmp_path / 'bag', 'a')
    assert [path.name for path in (tmp_path / 'bag').iterdir()] == ['metadata.yaml']


def test_what_cannot_be_written_is_said_before_the_work(tmp_path: Path) -> None:
    (tmp_path / 'file').write_text('mine')
    for path in (tmp_path / 'file' / 'found', Path('/proc/found')):
        with pytest.raises(SettingsError, match=r'found cannot be written: .*(file|/proc)'):
            check_folder(path)
    check_folder(tmp_path / 'deep' / 'out')
    assert [path.name for path in tmp_path.iterdir()] == ['file']


def test_a_folder_may_be_a_file_system_of_its_own(tmp_path: Path) -> None:
    """As in a container: nothing can be moved into it from beside it, so all is made in it."""
    for place in (tmp_path / 'mounted', tmp_path / 'mounted'):
        place.mkdir(exist_ok=True)
        with result_folder(place, 'result.json') as folder:
            assert place in folder.parents
            (folder / 'result.json').write_text('x')
        assert {path.name for path in place.iterdir()} == {'result.json', '.result.json.files'}


@pytest.mark.parametrize(('there', 'kept'), [
    ('schema: x\nvalue: 1\n', False), ('', False), ('my own\n', True), ('schema: y\n', True),
    ('schema', True)])
def test_a_single_file_is_replaced_only_by_its_like(
        tmp_path: Path, there: str, kept: bool) -> None:
    path = tmp_path / 'file.yaml'
    check_ours(path, 'schema: x')
    path.write_text(there)
    if not kept:
        check_ours(path, 'schema: x')
        return
    with pytest.raises(SettingsError, match='exists and is no such result of lg_husky'):
        check_ours(path, 'schema: x')


@pytest.mark.parametrize('name', ['a.yaml', 'a.tum', 'a.h', 'a.tex', 'a.py'])
@pytest.mark.parametrize('change', [
    lambda text: text + '# mine\n', lambda text: text.replace('0', '1', 1),
    lambda text: text.rsplit('\n', 2)[0] + '\n', lambda text: text.replace('\n', '\r\n')])
def test_a_file_that_begins_like_a_result_but_is_by_hand_stays(
        tmp_path: Path, name: str, change: Callable[[str], str]) -> None:
    path, husky = tmp_path / name, lg.Husky()
    for _ in range(2):  # its like is replaced
        _write(husky, path)
    changed = change(path.read_text())
    assert changed != path.read_text()
    path.write_text(changed, newline='')
    with pytest.raises(SettingsError, match=f'{name} exists and was written or changed by hand'):
        _write(husky, path)
    assert path.read_bytes() == changed.encode()


def _write(husky: lg.Husky, path: Path) -> None:
    if path.suffix == '.yaml':
        husky.save(path)
    elif path.suffix == '.tum':
        husky.simulate([[0.0, 0.0, 0.0], [1.0, 0.5, 0.0]]).save_tum(path)
    else:
        husky.export(path)


def test_a_planned_drive_replaces_a_planned_drive_and_none_by_hand(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:
    best = Separation(find_manoeuvre('spin'), 9.0, 'yaw rate')
    monkeypatch.setattr('lg_husky_sim.diagnosis.planning.plan', lambda *_: (best,))
    path = tmp_path / 'plan.yaml'
    arguments = ['plan-drive', '--effects', 'payload,yaw_scrub_coulomb', '--out', str(path)]
    assert [run(arguments), run(arguments)] == [0, 0]
    mine = f'schema: {COMMANDS}\nsteps:\n- {{duration: 1.0, forward: 0.5}}\n'
    path.write_text(mine)
    assert run(arguments) == 1
    assert 'plan.yaml exists and was written or changed by hand' in capsys.readouterr().err
    assert path.read_text() == mine


def test_a_model_that_was_changed_in_a_folder_of_results_is_kept(tmp_path: Path) -> None:
    out = tmp_path / 'found'
    for text in ('first', 'second', 'third'):
        _fill(out, 'model.yaml', signed(f'{text}\n'))
        if text == 'second':
            (out / 'model.yaml').write_text(signed('second\n').replace('second', 'mine'))
    assert (out / 'model.yaml').read_text().startswith('third')
    assert (out / 'model.yaml~').read_text().startswith('mine')
    assert not (out / 'model.yaml~~').exists()


def test_the_model_of_a_fit_that_was_changed_is_kept(tmp_path: Path) -> None:
    path = lg.Husky().save(tmp_path / 'fit.yaml')
    (tmp_path / 'fit.json').write_text('{\n "schema": "lg_husky_sim/fit/1"\n}\n')
    report_paths(path)
    path.write_text(path.read_text().replace('about:', 'about: mine,'))
    with pytest.raises(SettingsError, match=r'fit\.yaml exists and was written or changed by'):
        report_paths(path)


def test_files_of_a_user_are_never_replaced(tmp_path: Path) -> None:
    model, way, plan = (tmp_path / name for name in ('a.yaml', 'a.tum', 'plan.yaml'))
    drive = lg.Husky().simulate([[0.0, 0.0, 0.0], [1.0, 0.5, 0.0]])
    for _ in range(2):  # the second time over its like
        lg.Husky(mass=60.0).save(model)
        drive.save_tum(way)
    with pytest.raises(SettingsError, match=r'a\.yaml exists and is no such result'):
        report_paths(model)  # a model, but no fit: somebody's robot
    for path in (model, way, plan, tmp_path / 'b.txt', tmp_path / 'bag.foxglove.json'):
        path.write_text('my own\n')
    compared = lg.compare(drive, progress=False)
    writers: list[tuple[Callable[[Path], object], Path, str]] = [
        (lg.Husky().save, model, 'a.yaml'), (drive.save_tum, way, 'a.tum'),
        (report_paths, model, 'a.yaml'), (report_paths, tmp_path / 'b.yaml', 'b.txt'),
        (compared.save_bag, tmp_path / 'bag', 'bag.foxglove.json')]
    for write, path, named in writers:
        with pytest.raises(SettingsError, match=f'{named} exists and is no such result'):
            write(path)
    assert run(['plan-drive', '--effects', 'payload,yaw_scrub_coulomb', '--out', str(plan)]) == 1
    assert {path.read_text() for path in tmp_path.iterdir()} == {'my own\n'}
