# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The public Python API: what it promises on its page, and how it treats what users give it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
import pkgutil
import re
import subprocess
import sys
from typing import Any

import lg_husky_sim as lg
from lg_husky_sim.api import progress
from lg_husky_sim.api.progress import Lines, shown
from lg_husky_sim.api.tables import Table
from lg_husky_sim.errors import CommandError, FitError, ParameterError, RecordingError
from lg_husky_sim.husky.model_file import default_model_path
from matplotlib.figure import Figure
import numpy as np
import pandas as pd
import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope='module')
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write a bag of the packaged Husky with more mass, on an s-bend."""
    return lg.Husky(mass=60.0).simulate('s_bend').save(
        tmp_path_factory.mktemp('bags') / 'drive')


def test_each_example_of_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = (ROOT / 'docs' / 'python.md').read_text(encoding='utf-8')
    blocks = re.findall(r'```python\n(.*?)```', text, re.DOTALL)
    assert len(blocks) >= 8
    names: dict[str, Any] = {}
    for block in blocks:
        exec(compile(block, 'docs/python.md', 'exec'), names)
    assert names['found'].verdict == 'known'
    found = names['found']
    assert [(one.effect, one.side) for one in found.findings] == [('coulomb_drivetrain', 'left')]
    errors = found.errors()
    assert errors.columns == (
        'held-out data', 'nominal', 'recalibrated', 'with finding', 'change')
    position = errors.rows[0]
    assert position[0] == 'position [m]'
    assert position[1:3] > (0.1, 0.1) > position[3:]
    html = found._repr_html_()
    assert '>nominal</th>' in html
    assert html.index('On the robot') < html.index('In the simulator')
    assert '<code>ros2 run lg_husky_sim sim_node' in html
    assert repr(found) == str(found)


def test_the_example_of_another_robot_runs(tmp_path: Path,
                                           monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = (ROOT / 'docs' / 'other_robots.md').read_text(encoding='utf-8')
    names: dict[str, Any] = {}
    for block in re.findall(r'```python\n(.*?)```', text, re.DOTALL):
        exec(compile(block, 'docs/other_robots.md', 'exec'), names)
    (finding,) = names['found'].findings
    assert finding.effect == 'coulomb_drivetrain'
    torque = next(one for one in finding.parameters if one.name == 'dry_torque')
    assert torque.low < 0.6 < torque.high


def test_the_page_says_what_is_public_and_nothing_else() -> None:
    text = (ROOT / 'docs' / 'python.md').read_text(encoding='utf-8')
    said = set(re.findall(r'\blg\.(\w+)', text))
    assert said <= set(lg.__all__)
    functions = {name for name in lg.__all__ if name[0].islower()}
    assert functions <= said


def test_importing_loads_nothing() -> None:
    ask = ('import sys\nbefore = set(sys.modules)\nimport lg_husky_sim\n'
           'print(*sorted(m for m in set(sys.modules) - before if "." not in m))')
    done = subprocess.run([sys.executable, '-c', ask], text=True, capture_output=True,
                          timeout=60, check=True)
    heavy = {'numpy', 'scipy', 'sympy', 'pandas', 'matplotlib', 'rosbags', 'numba', 'yaml'}
    assert not heavy & set(done.stdout.split())


def test_no_public_name_is_that_of_a_module() -> None:
    """Importing the module would put it in the name's place."""
    modules = {module.name for module in pkgutil.iter_modules(lg.__path__)}
    assert not modules & set(lg.__all__)


def test_every_public_name_is_there_and_an_unknown_one_is_not() -> None:
    for name in lg.__all__:
        assert getattr(lg, name) is not None
    assert [name for name in dir(lg) if name[0] != '_'] == sorted(
        name for name in lg.__all__ if name[0] != '_')
    with pytest.raises(AttributeError, match="no attribute 'reed'"):
        lg.reed  # noqa: B018  # type: ignore[attr-defined]


def test_a_recording_has_its_streams_as_attributes(drive: Path) -> None:
    recording = lg.read(drive)
    assert recording.wheels.names == ('left', 'right')
    assert np.array_equal(recording.wheels.to_pandas()['left'], recording.wheels.column('left'))
    assert recording.wheels.to_pandas().index.name == 'time'
    with pytest.raises(RecordingError, match='has no voltage; streams: '):
        recording.voltage  # noqa: B018


def test_all_streams_make_one_frame_without_losing_a_sample(drive: Path) -> None:
    recording = lg.read(drive)
    frame = recording.to_pandas()
    assert frame.index.is_monotonic_increasing
    for name, series in recording.streams.items():
        for column in series.names:
            assert frame[f'{name}.{column}'].notna().sum() == len(np.unique(series.times))


def test_a_recording_saved_and_read_is_the_same(drive: Path, tmp_path: Path) -> None:
    recording = lg.read(drive)
    again = lg.read(recording.save(tmp_path / 'copy', storage='sqlite3'))
    for name in ('wheels', 'imu', 'pose'):
        assert np.allclose(again.stream(name).values, recording.stream(name).values, atol=1e-9)
    with pytest.raises(RecordingError, match='exists already'):
        recording.save(tmp_path / 'copy')


def test_a_trajectory_for_evo_holds_the_measured_pose(drive: Path, tmp_path: Path) -> None:
    recording = lg.read(drive)
    rows = np.loadtxt(recording.save_tum(tmp_path / 'drive.tum'))
    pose = recording.pose
    assert rows.shape == (len(pose.times), 8)
    assert np.diff(rows[:, 0]) == pytest.approx(np.diff(pose.times), abs=1e-6)
    assert rows[:, 1:3] == pytest.approx(pose.values[:, :2], abs=1e-6)
    assert 2.0 * np.arctan2(rows[:, 6], rows[:, 7]) == pytest.approx(
        np.arctan2(np.sin(pose.values[:, 2]), np.cos(pose.values[:, 2])), abs=1e-6)
    assert not np.any(rows[:, [3, 4, 5]])


def test_a_folder_of_bags_stands_for_all_of_them(drive: Path, tmp_path: Path) -> None:
    for name in ('b', 'a'):
        lg.read(drive).save(tmp_path / name)
    (tmp_path / 'notes.txt').write_text('not a bag')
    assert [one.name for one in lg.read_all(tmp_path)] == ['a', 'b']
    with pytest.raises(RecordingError, match=r'holds 2 recordings \(a, b\): use read_all'):
        lg.read(tmp_path)


def test_topics_are_chosen_by_role(drive: Path) -> None:
    with pytest.raises(RecordingError, match='ROLE one of command'):
        lg.read(drive, topics={'comand': '/cmd_vel'})
    with pytest.raises(RecordingError, match='/nowhere'):
        lg.read(drive, topics={'command': '/nowhere'})


def test_settings_are_checked_like_those_of_a_file() -> None:
    assert lg.Husky(mass=60.0).parameters['mass'] == 60.0
    with pytest.raises(ParameterError, match='did you mean mass'):
        lg.Husky(mas=60.0)
    with pytest.raises(ParameterError, match='mass = -1 kg is not positive'):
        lg.Husky(mass=-1.0)


def test_matrices_in_symbols_and_numbers_agree() -> None:
    husky = lg.Husky()
    symbols = {str(one): one for one in husky.A.free_symbols}
    numeric = husky.numeric()
    values = {branch.name: branch for branch in husky.graph.branches}
    assert set(symbols) <= set(values) | {e.name for e in husky.graph.two_ports}
    assert numeric.A.shape == husky.A.shape == (6, 6)
    assert numeric.states == husky.states
    assert husky.numeric(mass=96.78).B.shape == husky.B.shape
    with pytest.raises(ParameterError, match="unknown parameter 'weight'"):
        husky.numeric(weight=3.0)


def test_a_model_saved_and_read_is_the_same(tmp_path: Path) -> None:
    husky = lg.Husky(mass=60.0).with_effect('torque_ripple', side='left', ripple_cos=1.5)
    again = lg.Husky(husky.save(tmp_path / 'robot.yaml'))
    assert again.model == husky.model
    assert [(e.id, e.side) for e in again.effects] == [('torque_ripple', 'left')]


def test_an_effect_that_is_not_in_the_catalogue_is_refused() -> None:
    with pytest.raises(ParameterError, match='did you mean torque_ripple'):
        lg.Husky().with_effect('torque_riple')
    with pytest.raises(ParameterError, match='is not one of'):
        lg.Husky().with_effect('torque_ripple', side='upper')


@pytest.mark.parametrize('form', ['three arrays', 'one array', 'frame', 'series'])
def test_commands_may_be_arrays_of_any_form(form: str) -> None:
    times = np.arange(0.0, 2.0, 0.1)
    forward, yaw = 0.5 + 0.0 * times, 0.1 * times
    forms: dict[str, Any] = {
        'three arrays': (times, forward, yaw),
        'one array': np.column_stack([times, forward, yaw]),
        'frame': pd.DataFrame({'forward': forward, 'yaw': yaw}, index=times),
        'series': lg.Husky().simulate((times, forward, yaw)).command}
    driven = lg.Husky().simulate(forms[form])
    assert np.array_equal(driven.command.column('yaw'), yaw)
    assert driven.pose.column('x')[-1] > 0.5


@pytest.mark.parametrize(('commands', 'said'), [
    ((np.zeros(3), np.zeros(2), np.zeros(3)), 'arrays of one length'),
    (np.zeros((4, 2)), r'shape \(4, 2\)'),
    (np.array([[0.0, 1.0, np.nan], [1.0, 1.0, 0.0]]), 'finite'),
    (np.array([[1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]), 'must not decrease'),
    (object(), 'of type object'),
    (pd.DataFrame({'forward': [0.0, 1.0]}), "no column 'yaw'"),
    ('s_bent', 'did you mean s_bend'),
    ('no/such/script', 'no such file'),
])
def test_commands_that_are_none_are_refused(commands: Any, said: str) -> None:
    with pytest.raises(CommandError, match=said):
        lg.Husky().simulate(commands)


def test_the_model_that_drove_explains_its_recording(drive: Path) -> None:
    table = lg.compare(drive, {'true': lg.Husky(mass=60.0), 'paper': lg.Husky()}).to_pandas()
    # It drives straight on: only its speed tells.
    speed = table.loc[('drive', 'forward RMS error')]
    assert speed['true'] < 0.2 * speed['paper']


def test_simulated_drives_stand_beside_each_other_without_a_file() -> None:
    husky = lg.Husky()
    bend, spin = husky.simulate('s_bend'), husky.simulate('spin')
    again = husky.simulate('s_bend')
    names = [one.recording.name for one in lg.compare([bend, spin, again]).outcomes]
    assert names == ['s_bend', 'spin', 's_bend 2']
    with pytest.raises(RecordingError, match='s_bend is given twice'):
        lg.compare([bend, bend])


def test_models_get_names_of_their_own(drive: Path, tmp_path: Path) -> None:
    path = lg.Husky(mass=60.0).save(tmp_path / 'heavy.yaml')
    assert lg.compare(drive, [lg.Husky(), path]).labels == ('paper', 'heavy')
    assert lg.compare(drive, [default_model_path(), path]).labels == ('paper', 'heavy')
    assert lg.compare(drive, lg.Husky(mass=60.0)).labels == ('model',)


def test_a_comparison_is_written_with_its_page(drive: Path, tmp_path: Path) -> None:
    page = lg.compare(drive).save(tmp_path / 'out')
    assert page.is_file()
    assert (tmp_path / 'out' / 'compare.json').is_file()


def test_a_negative_horizon_is_refused(drive: Path) -> None:
    with pytest.raises(CommandError, match=r'horizon = -1\.0 s must be 0'):
        lg.compare(drive, horizon=-1.0)


def test_a_fit_recovers_what_drove_and_shows_itself(drive: Path, tmp_path: Path) -> None:
    fit = lg.Husky().identify(drive, free=['mass'], starts=1, progress=False)
    row = fit.to_pandas().loc['mass']
    assert row['low'] <= 60.0 <= row['high'] or abs(fit.values['mass'] - 60.0) < 0.5
    assert fit.husky.parameters['mass'] == fit.values['mass']
    figure = Figure()
    axes = figure.subplots()
    assert fit.plot(axes) is axes
    assert 'mass' in fit._repr_html_()
    paths = fit.save(tmp_path / 'fit.yaml')
    assert all(path.is_file() for path in paths)
    page = paths[-1].read_text(encoding='utf-8')
    assert page.index('<h2>What to change</h2>') < page.index('<h2>Parameters</h2>')
    assert 'model:=fit.yaml' in page
    assert fit.what_to_change.errors == ()
    # A folder, as those of a comparison and of a diagnosis, or a model file.
    assert fit.report(tmp_path / 'fitted') == tmp_path / 'fitted' / 'fit.html'
    assert fit.report(tmp_path / 'heavy.yaml') == tmp_path / 'heavy.html'


def test_a_fit_says_what_still_differs_from_it(drive: Path) -> None:
    """The robot of the drive starts late: no mass makes up for that."""
    recording = lg.read(drive)
    late = recording.command
    moved = replace(recording, streams={**recording.streams, 'command': type(late)(
        late.times - 0.4, late.values, late.names)})
    fit = lg.Husky(mass=60.0).identify(moved, free=['mass'], starts=1, progress=False)
    assert [one.kind for one in fit.what_to_change.errors] == ['late']
    assert 'latency' in ' '.join(fit.what_to_change.errors[0].simulator)


def test_an_unknown_method_lists_those_there_are(drive: Path) -> None:
    with pytest.raises(FitError, match='there are ga, de, least-squares'):
        lg.Husky().identify(drive, method='newton')


def test_what_notebooks_show_is_escaped() -> None:
    table = Table('<i>', ('<b>',), (('<script>',), (1.0,)))
    assert '<script>' not in table.html()
    assert '&lt;script&gt;' in table.html()


def test_results_show_themselves_in_notebooks(drive: Path) -> None:
    recording = lg.read(drive)
    for shown_result in (recording, recording.info(), lg.Husky(), lg.compare(drive)):
        assert '<table>' in shown_result._repr_html_()
    assert r'\frac{d}{dt}' in str(lg.Husky()._repr_latex_())
    effects = lg.list_effects()
    assert '<td style="text-align:left">torque_ripple</td>' in effects._repr_html_()


def test_results_show_themselves_in_an_interpreter(drive: Path) -> None:
    survey = lg.read(drive).info()
    for one in (survey, survey.parameters, lg.list_effects(), lg.compare(drive)):
        assert repr(one) == str(one)
        assert type(one).__name__ not in repr(one)


@pytest.mark.filterwarnings('error')
def test_progress_in_a_notebook_without_widgets_is_a_line(
        monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(progress, 'in_notebook', lambda: True)
    monkeypatch.setattr(progress, 'find_spec', lambda name: None)
    with shown(True) as report:
        report('recalibration', 0.5)
    said = capsys.readouterr().err
    assert 'recalibration' in said
    assert ' 50 %' in said
    assert 'it/s' not in said


def test_drawing_needs_the_right_number_of_axes(drive: Path) -> None:
    recording = lg.read(drive)
    axes = Figure().subplots(1, 3)
    with pytest.raises(ParameterError, match='3 axes given; a recording is drawn into 4'):
        recording.plot(axes)
    with pytest.raises(ParameterError, match='3 axes given; a comparison is drawn into 4'):
        lg.compare(recording).plot(axes)


def test_a_square_of_axes_is_four_of_them(drive: Path) -> None:
    square = Figure().subplots(2, 2)
    assert list(lg.read(drive).plot(square)) == list(square.flat)


def test_progress_is_told_to_a_function_and_kept_quiet_without_a_watcher(
        drive: Path, capsys: pytest.CaptureFixture[str]) -> None:
    told: list[tuple[str, float | None]] = []
    lg.compare(drive, progress=lambda stage, share: told.append((stage, share)))
    assert [stage for stage, _ in told] == ['reading drive', 'replaying drive']
    lg.compare(drive)
    assert capsys.readouterr() == ('', '')


def test_lines_of_progress_name_each_stage_once() -> None:
    lines: list[str] = []
    report = Lines(lines.append)
    for share in (0.0, 0.1, 0.2):
        report('reading', share)
    report('fitting', None)
    assert [line.split()[-1] for line in lines] == ['reading', 'fitting']
    with shown(False) as silent:
        silent('nothing', 0.5)


def test_lines_of_progress_do_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    """A genetic algorithm has a hundred generations, and a log is no place for all of them."""
    now: list[float] = [0.0]
    lines: list[str] = []
    monkeypatch.setattr('lg_husky_sim.api.progress.time.monotonic', lambda: now[0])
    report = Lines(lines.append)
    for generation in range(100):
        now[0] = 0.1 * generation
        report(f'generation {generation}, {100.0 / (1 + generation):.4g} m', None)
    report('noise', None)
    assert [line.split(maxsplit=2)[-1] for line in lines] == [
        'generation 0, 100 m', 'generation 50, 1.961 m', 'noise']
