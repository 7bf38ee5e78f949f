# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky simulate` and `lg_husky compare` as their user runs them."""

from __future__ import annotations

from dataclasses import replace
import json
import os
from pathlib import Path
import re
from typing import Any

import lg_husky_sim as lg
from lg_husky_sim.cli.main import run
from lg_husky_sim.comparison.page import report_data
from lg_husky_sim.diagnosis.hypotheses.hypothesis import entries_of
from lg_husky_sim.husky.effects import Effect, Onset, OnsetKind
from lg_husky_sim.husky.model_file import load_model, ModelFile, save_model
from lg_husky_sim.recording import read_recording, segments, write_recording
from lg_husky_sim.signals import TimeSeries
import numpy as np
import pytest
from scipy.integrate import trapezoid

for needed in ('rosbags', 'matplotlib', 'jinja2'):
    pytest.importorskip(needed)

SCRIPT = """\
schema: lg_husky_sim/commands/1
steps:
  - {duration: 1.0, forward: 0.5, yaw: 0.0}
  - {duration: 2.0, forward: 0.5, yaw: 0.4, ramp: 0.5}
"""


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """Return a drive of three seconds, simulated from a script."""
    (tmp_path / 'turn.yaml').write_text(SCRIPT)
    assert run(['simulate', '--commands', str(tmp_path / 'turn.yaml'),
                '--out', str(tmp_path / 'turn')]) == 0
    return tmp_path / 'turn'


def _message(capsys: Any) -> str:
    text: str = capsys.readouterr().err
    assert text.count('\n') == 1
    assert text.startswith('error: ')
    return text


def test_simulate_a_script(bag: Path) -> None:
    recording = read_recording(bag)
    assert set(recording.streams) == {
        'command', 'wheels', 'wheel_angles', 'wheel_torques', 'imu', 'pose'}
    assert len(recording.stream('command')) == 61
    wheels, angles = recording.stream('wheels'), recording.stream('wheel_angles')
    np.testing.assert_allclose(wheels.times, np.arange(151) / 50, atol=1e-9)
    # An encoder counts ticks over a period: its rate is the mean over the period before.
    by_sum = (wheels.values[1:] * np.diff(wheels.times)[:, None]).sum(axis=0)
    np.testing.assert_allclose(angles.values[-1], by_sum, atol=1e-9)
    imu, pose = recording.stream('imu'), recording.stream('pose')
    turned = trapezoid(imu.column('yaw_rate'), imu.times)
    assert pose.values[-1, 2] == pytest.approx(turned, rel=2e-3)
    np.testing.assert_allclose(
        imu.column('accel_y')[-1], 0.507 * imu.column('yaw_rate')[-1], rtol=0.01)


def test_simulate_with_rate_storage_and_setting(bag: Path) -> None:
    folder = bag.parent
    assert run(['simulate', '--commands', str(folder / 'turn.yaml'), '--rate', '200',
                '--storage', 'sqlite3', '--set', 'mass=60', '--out', str(folder / 'fast')]) == 0
    assert (folder / 'fast' / 'fast.db3').is_file()
    fast, plain = read_recording(folder / 'fast'), read_recording(bag)
    assert len(fast.stream('pose')) == 601
    heavier = fast.stream('imu').column('accel_x')[4]
    assert heavier < plain.stream('imu').column('accel_x')[1]


def test_simulate_a_recording_with_a_gap_at_its_own_stamps(bag: Path) -> None:
    original = read_recording(bag)
    turned = {name: series for name, series in original.streams.items() if name != 'imu'}
    x, y, heading = turned['pose'].values.T
    pose = np.column_stack((5.0 + np.cos(1.0) * x - np.sin(1.0) * y,
                            -3.0 + np.sin(1.0) * x + np.cos(1.0) * y, heading + 1.0))
    turned['pose'] = TimeSeries(turned['pose'].times, pose, turned['pose'].names)

    def holed(series: TimeSeries) -> TimeSeries:
        kept = (series.times < 0.97) | (series.times > 1.93)
        return TimeSeries(series.times[kept], series.values[kept], series.names)
    path = write_recording(bag.parent / 'holed',
                           {name: holed(series) for name, series in turned.items()})
    out = bag.parent / 'again'
    assert run(['simulate', '--commands', str(path), '--out', str(out)]) == 0
    again = read_recording(out)
    assert again.start_ns == read_recording(path).start_ns
    assert len(segments(again)) == 2
    known = read_recording(path).stream('pose')
    covered = (known.times <= 0.95 + 1e-9) | (known.times >= 1.95 - 1e-9)  # by commands
    known = TimeSeries(known.times[covered], known.values[covered], known.names)
    np.testing.assert_allclose(again.stream('pose').times, known.times, atol=1e-9)
    np.testing.assert_allclose(again.stream('pose').values, known.values, atol=0.01)
    assert np.median(np.diff(again.stream('imu').times)) == pytest.approx(0.02)


def test_simulate_is_the_same_bit_for_bit(bag: Path, capsys: Any) -> None:
    again = bag.parent / 'again' / 'turn'
    assert run(['simulate', '--commands', str(bag.parent / 'turn.yaml'),
                '--out', str(again)]) == 0
    assert 'turn: 3.0 s, 151 poses, ends at x = 1.' in capsys.readouterr().out
    assert (again / 'turn.mcap').read_bytes() == (bag / 'turn.mcap').read_bytes()


def test_simulate_says_where_a_slower_robot_stays_behind(tmp_path: Path, capsys: Any) -> None:
    for number, (gain, said) in enumerate(((0.8961, False), (1.6, True))):
        assert run(['simulate', '--commands', 'stop_and_go', '--set', f'command_gain={gain}',
                    '--out', str(tmp_path / str(number))]) == 0
        printed = capsys.readouterr().out
        assert ('commands ask 0.90 m/s of a side, and the model has its whole supply at 0.62 m/s'
                in printed) is said


@pytest.mark.parametrize(('arguments', 'message'), [
    (['--commands', 'circel', '--out', 'x'], "no manoeuvre 'circel'; did you mean circle?"),
    (['--commands', 'no/bag', '--out', 'x'], 'no recording or command script no/bag'),
    (['--commands', 'nowhere.mcap', '--out', 'x'], 'no recording nowhere.mcap'),
    (['--commands', 'none.yaml', '--out', 'x'], 'none.yaml: No such file'),
    (['--commands', 'circle', '--out', '.'], '. exists already'),
    (['--commands', 'circle', '--out', 'x', '--rate', '0'], 'rate = 0 Hz must be positive'),
    (['--commands', 'circle', '--out', 'x', '--rate', 'nan'], 'rate = nan Hz must be positive'),
    (['--commands', 'circle', '--out', 'x', '--rate', '1e-9'], 'rate = 1e-09 Hz gives a single'),
    (['--commands', 'circle', '--out', 'x', '--set', 'mas=2'], 'did you mean mass'),
    (['--commands', 'circle', '--out', 'x', '--set', 'mass=-2'], 'mass = -2 kg is not positive'),
    (['--commands', 'circle', '--out', 'x', '--topic', 'imu=/a'], 'topics can only be chosen for'),
    (['--commands', 'circle', '--out', 'x', '--model', 'm.yaml'], 'm.yaml'),
])
def test_simulate_refuses_in_one_line(
    arguments: list[str], message: str, tmp_path: Path, monkeypatch: Any, capsys: Any,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(['simulate', *arguments]) == 1
    assert message in _message(capsys)
    assert list(tmp_path.iterdir()) == []


def test_compare_models_and_a_rival(bag: Path, capsys: Any) -> None:
    folder = bag.parent
    from lg_husky_sim.husky.model_file import apply_settings, load_model, save_model
    save_model(apply_settings(load_model(), {'command_gain': 0.95}), folder / 'eager.yaml')
    assert run(['simulate', '--commands', str(folder / 'turn.yaml'),
                '--set', 'yaw_damping=30', '--out', str(folder / 'engine')]) == 0
    from lg_husky_sim.husky.model_file import default_model_path
    out = folder / 'result'
    assert run(['compare', str(bag), '--model', str(default_model_path()), '--model',
                str(folder / 'eager.yaml'), '--rival', str(folder / 'engine'),
                '--out', str(out)]) == 0
    printed = capsys.readouterr().out
    assert re.search(r'root mean square error +paper +eager +engine', printed)
    data = json.loads((out / 'compare.json').read_text())
    assert data['schema'] == 'lg_husky_sim/comparison/1'
    results = data['recordings'][0]['results']
    assert list(results) == ['paper', 'eager', 'engine']
    assert results['paper']['rmse']['wheel_speed'] < 2e-3
    # The wheels' speed is proportional to the command gain: 0.95 / 0.8961, some 3.1 rad/s.
    assert results['eager']['rmse']['wheel_speed'] == pytest.approx(0.185, rel=0.1)
    assert results['engine']['rmse']['yaw_rate'] > 10 * results['paper']['rmse']['yaw_rate']
    assert results['engine']['bounds_m']['y'] > 0.05
    assert results['paper']['bounds_m']['x'] < 2e-3
    assert data['models'][1]['parameters']['command_gain'] == 0.95
    assert (out / 'compare.txt').read_text().strip() in printed
    names = {path.name for path in out.iterdir()}
    assert names == {'compare.json', 'compare.txt', 'index.html', '01_turn_responses.png',
                     '01_turn_trajectory.png', 'before_after.png', '.compare.json.files'}
    page = (out / 'index.html').read_text()
    assert 'Closest to the recordings: paper' in page
    assert re.search(r'recording turn</td><td class="words"><code>[0-9a-f]{64}</code>', page)


def test_the_page_is_self_contained_and_escaped(bag: Path) -> None:
    name = '<script>alert(1)</script>'
    evil = write_recording(bag.parent / 'evil', read_recording(bag).streams)
    evil = evil.rename(bag.parent / name.replace('/', '∕'))
    out = bag.parent / 'result'
    assert run(['compare', str(evil), '--out', str(out), '--horizon', '1.5']) == 0
    page = (out / 'index.html').read_text()
    assert '<script>alert' not in page
    assert '&lt;script&gt;alert' in page
    assert page.count('src="data:image/png;base64,') == 3
    assert not re.search(r'(src|href)="(?!data:|#)', page)


def test_compare_replaces_its_own_results_only(bag: Path, capsys: Any) -> None:
    out = bag.parent / 'result'
    assert run(['compare', str(bag), '--out', str(out), '--figures', '1']) == 0
    pictures = list(out.glob('*.png'))
    assert pictures
    (out / 'mine.png').write_bytes(b'kept')
    assert run(['compare', str(bag), '--out', str(out), '--figures', '0']) == 0
    assert not any(picture.exists() for picture in pictures)
    assert (out / 'mine.png').read_bytes() == b'kept'
    capsys.readouterr()
    before = sorted(bag.iterdir())
    assert run(['compare', str(bag), '--out', str(bag)]) == 1
    assert 'is a recording; choose another folder' in _message(capsys)
    assert sorted(bag.iterdir()) == before


@pytest.mark.parametrize(('extra', 'message'), [
    (['--horizon', '-1'], 'horizon = -1.0 s must be 0, or a number of at least 0.01 s'),
    (['--horizon', 'nan'], 'horizon = nan s must be 0, or a number of at least 0.01 s'),
    (['--horizon', '0.0001'], 'horizon = 0.0001 s must be 0, or a number of at least 0.01 s'),
    (['--rival', '/dev/null', '--rival', '/dev/null'], '2 rivals for 1 recordings'),
    (['--topic', 'command=/nope'], 'no topic /nope for command; there are'),
    (['--set', 'mass=nan'], 'mass = nan kg is not a finite number'),
])
def test_compare_refuses_in_one_line(
    extra: list[str], message: str, bag: Path, capsys: Any,
) -> None:
    before = set(bag.parent.iterdir())
    capsys.readouterr()
    assert run(['compare', str(bag), '--out', str(bag.parent / 'result'), *extra]) == 1
    assert message in _message(capsys)
    assert set(bag.parent.iterdir()) == before


def test_compare_needs_commands_and_a_measurement(bag: Path, capsys: Any) -> None:
    streams = read_recording(bag).streams
    for name, kept, message in (
            ('mute', ('wheels', 'pose'), 'has no command; streams: wheels, pose'),
            ('blind', ('command',), 'has nothing to compare: its streams (command)')):
        path = write_recording(bag.parent / name, {key: streams[key] for key in kept})
        capsys.readouterr()
        assert run(['compare', str(path), '--out', str(bag.parent / 'result')]) == 1
        assert message in _message(capsys)


def test_a_rival_may_end_early_and_be_called_like_a_model(bag: Path) -> None:
    whole = read_recording(bag)
    rival = write_recording(bag.parent / 'paper', {
        name: series.slice(0.0, 1.6) for name, series in whole.streams.items()},
        start_ns=whole.start_ns)
    assert run(['compare', str(bag), '--horizon', '1', '--rival', str(rival),
                '--out', str(bag.parent / 'result')]) == 0
    data = json.loads((bag.parent / 'result' / 'compare.json').read_text())
    assert [list(part['results']) for part in data['recordings'][0]['segments']] == [
        ['paper', 'paper (rival)'], ['paper', 'paper (rival)'], ['paper']]
    counts = [result['samples'] for result in data['recordings'][0]['results'].values()]
    share = min(counts[1][channel] / number for channel, number in counts[0].items())
    assert 0.3 < share < 0.6
    said = ('the errors of paper (rival) cover only a part of the drive, as little as '
            f'{share:.0%} of the samples of the others')
    assert data['recordings'][0]['notes'] == [said]
    for name in ('compare.txt', 'index.html'):
        assert said in (bag.parent / 'result' / name).read_text()


@pytest.mark.parametrize('kept', [('wheels',), ('pose',), ('imu',)])
def test_compare_with_one_measured_stream(kept: tuple[str, ...], bag: Path) -> None:
    streams = read_recording(bag).streams
    path = write_recording(bag.parent / 'one',
                           {key: streams[key] for key in ('command', *kept)})
    out = bag.parent / 'result'
    assert run(['compare', str(path), '--rival', str(path), '--out', str(out)]) == 0
    data = json.loads((out / 'compare.json').read_text())
    results = data['recordings'][0]['results']
    expected = {'wheels': ['wheel_left', 'wheel_right', 'wheel_speed'],
                'pose': ['forward', 'yaw_rate', 'heading', 'position'],
                'imu': ['yaw_rate', 'accel_x']}[kept[0]]
    for label in ('paper', 'one'):
        assert list(results[label]['rmse']) == expected
    assert max(results['one']['rmse'].values()) < 0.02  # the rival is the recording itself
    assert (results['paper']['bounds_m']['x'] is None) == (kept != ('pose',))


def test_a_model_knows_its_recordings_by_their_folders(bag: Path, tmp_path: Path) -> None:
    """An effect that begins between two bags of one name is found in the later one only."""
    effect = Effect('gyro_bias')
    plain = load_model()
    model = ModelFile(
        plain.structure.with_effect(
            replace(effect, late=True),
            Onset(OnsetKind.TIME, 1.0, 'tue/drive', ('drive',))),
        plain.parameters.with_entries(*entries_of(effect, {'gyro_bias': 0.2})), 'bias')
    save_model(model, tmp_path / 'found.yaml')
    turned = {}
    for day in ('mon', 'tue'):
        (tmp_path / day).mkdir()
        bag.rename(tmp_path / day / 'drive')
        assert run(['simulate', '--commands', str(tmp_path / day / 'drive'), '--model',
                    str(tmp_path / 'found.yaml'), '--out', str(tmp_path / f'{day}_sim')]) == 0
        (tmp_path / day / 'drive').rename(bag)
        turned[day] = read_recording(tmp_path / f'{day}_sim').stream('imu').values[-1, 0]
    assert turned['tue'] - turned['mon'] == pytest.approx(0.2, abs=0.01)


def test_a_name_that_is_not_utf_8_is_no_reason_to_lose_results(bag: Path, tmp_path: Path) -> None:
    place = bag.rename(tmp_path / os.fsdecode(b'caf\xe9'))
    assert run(['compare', str(place), '--out', str(tmp_path / 'result')]) == 0
    data = json.loads((tmp_path / 'result' / 'compare.json').read_text(encoding='utf-8'))
    assert data['recordings'][0]['name'] == 'caf?'


def test_a_page_does_not_begin_with_the_scatter_of_a_pose() -> None:
    drive = lg.Husky(mass=60.0).simulate('s_bend')
    pose = drive.pose
    noise = np.random.default_rng(2).normal(0.0, 0.05, pose.values.shape) * (1.0, 1.0, 0.0)
    noisy = replace(drive, streams={**drive.streams, 'pose': TimeSeries(
        pose.times, pose.values + noise, pose.names)})
    compared = lg.compare(drive), lg.compare(noisy)
    pages = [report_data(found.outcomes, found.plants) for found in compared]
    said = 'has a scatter of at least'
    assert [sum(said in note for note in page.notes) for page in pages] == [0, 1]
    # Whoever reads the terminal or the JSON only is told, too.
    for text in (str, lambda found: json.dumps(found.data()), lambda found: found._repr_html_()):
        assert [text(found).count(said) for found in compared] == [0, 1]
    assert all(page.view is not None for page in pages)
    assert pages[1].view.channel != 'forward'  # type: ignore[union-attr]


@pytest.mark.parametrize('interval', [0.28, 0.58])
def test_a_pose_too_slow_for_a_speed_is_compared_as_well(
        bag: Path, tmp_path: Path, interval: float) -> None:
    """Nothing is predicted of speeds that are not known: they do not choose what is shown."""
    recording = read_recording(bag)
    pose = recording.streams['pose']
    few = np.unique(np.searchsorted(pose.times, np.arange(
        pose.times[0], pose.times[-1], interval)))
    slow = replace(recording, streams={**recording.streams, 'pose': TimeSeries(
        pose.times[few], pose.values[few], pose.names)})
    lg.compare(slow, progress=False).save(tmp_path / 'slow')
    assert (tmp_path / 'slow' / 'index.html').stat().st_size > 0
