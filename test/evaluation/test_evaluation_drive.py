# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Runs of the DRIVE data set are read without trusting their pickles."""

from __future__ import annotations

from collections.abc import Mapping
import os
from pathlib import Path
import pickle
import sys
import tracemalloc
import types
from typing import Any

from lg_husky_sim.cli.main import run
from lg_husky_sim.errors import RecordingError, SettingsError
from lg_husky_sim.evaluation.data_frame import read_columns
from lg_husky_sim.evaluation.drive_dataset import read_drive
from lg_husky_sim.recording import read_recording, segments
import numpy as np
import pytest

START = 1_730_815_945_864_589_846


@pytest.fixture
def pandas(monkeypatch: pytest.MonkeyPatch) -> types.SimpleNamespace:
    """Classes under the names of pandas', so that a pickle like pandas' can be made without it."""
    made: dict[str, Any] = {}

    def module(name: str, **content: Any) -> None:
        one = types.ModuleType(name)
        for key, value in content.items():
            value.__module__, value.__qualname__, value.__name__ = name, key, key
            setattr(one, key, value)
            made[key] = value
        monkeypatch.setitem(sys.modules, name, one)

    class Frame:
        def __init__(self, mgr: Any) -> None:
            self._mgr = mgr

        def __reduce__(self) -> Any:
            return (Frame.__new__, (Frame,), {'_mgr': self._mgr, '_typ': 'dataframe'})

        def __reduce_ex__(self, protocol: Any) -> Any:
            import copyreg
            return (copyreg.__newobj__, (Frame,),  # type: ignore[attr-defined]
                    {'_mgr': self._mgr, '_typ': 'dataframe'})

    class Manager:
        def __init__(self, *arguments: Any) -> None:
            self.arguments = arguments

        def __reduce_ex__(self, protocol: Any) -> Any:
            return Manager, self.arguments

    class Index:
        pass

    def _unpickle_block(*arguments: Any) -> Any:
        raise AssertionError('only its name is pickled')

    def _new_Index(*arguments: Any) -> Any:  # noqa: N802
        raise AssertionError('only its name is pickled')
    module('pandas')
    module('pandas.core')
    module('pandas.core.internals')
    module('pandas.core.indexes')
    module('pandas._libs')
    module('pandas.core.frame', DataFrame=Frame)
    module('pandas.core.internals.managers', BlockManager=Manager)
    module('pandas.core.indexes.base', Index=Index, _new_Index=_new_Index)
    module('pandas._libs.internals', _unpickle_block=_unpickle_block)
    return types.SimpleNamespace(**made)


class Call:
    """Pickles as a call of a function with arguments."""

    def __init__(self, function: Any, *arguments: Any) -> None:
        self.call = (function, arguments)

    def __reduce_ex__(self, protocol: Any) -> Any:
        return self.call


def write(pandas: types.SimpleNamespace, path: Path, columns: Mapping[str, Any]) -> Path:
    names = np.array(list(columns), dtype=object)
    values = np.array([list(column) for column in columns.values()], dtype=object)
    block = Call(pandas._unpickle_block, values, slice(0, len(columns), 1), 2)
    axis = Call(pandas._new_Index, pandas.Index, {'data': names, 'name': None})
    path.write_bytes(pickle.dumps(pandas.DataFrame(pandas.BlockManager((block,), [axis, None]))))
    return path


def raw(count: int = 200) -> dict[str, list[str]]:
    seconds = 0.05 * np.arange(count)
    heading = 0.2 * seconds
    # The encoders speak at every third row, the localisation at every second one.
    held = 0.05 * 3.0 * (np.arange(count) // 3)
    columns: dict[str, Any] = {
        'ros_time': [str(START + round(1e9 * s)) for s in seconds],
        'calib_state': ['idle'] * 20 + ['calib'] * (count - 20),
        'icp_index': [str(k // 2) for k in range(count)],
        'meas_left_vel': np.sin(held), 'meas_right_vel': np.cos(held),
        'cmd_vel_x': np.full(count, 0.4), 'cmd_vel_omega': np.full(count, 0.1),
        'icp_pos_x': 0.4 * seconds, 'icp_pos_y': 0.1 * seconds,
        'icp_quat_x': np.zeros(count), 'icp_quat_y': np.zeros(count),
        'icp_quat_z': np.sin(0.5 * heading), 'icp_quat_w': np.cos(0.5 * heading),
        'imu_z': np.zeros(count), 'imu_acceleration_x': np.zeros(count),
        'imu_acceleration_y': np.zeros(count)}
    return {name: [str(cell) for cell in column] for name, column in columns.items()}


def test_a_raw_run_becomes_streams_at_the_sensors_own_rates(
        pandas: types.SimpleNamespace, tmp_path: Path) -> None:
    result = read_drive(write(pandas, tmp_path / 'raw.pkl', raw()))
    assert result.start_ns == START + 20 * 50_000_000
    streams = result.streams
    assert set(streams) == {'command', 'wheels', 'pose'}
    assert len(streams['command']) == 180
    assert len(streams['wheels']) == pytest.approx(60, abs=1)
    assert len(streams['pose']) == 90
    np.testing.assert_allclose(streams['pose'].column('heading'),
                               0.2 * (streams['pose'].times + 1.0), atol=1e-9)


def test_a_processed_run_is_chained(pandas: types.SimpleNamespace, tmp_path: Path) -> None:
    columns: dict[str, Any] = {'start_time': [10.0, 12.0]}
    for k in range(40):
        columns |= {f'cmd_left_{k}': [2.0, 2.0], f'cmd_right_{k}': [4.0, 4.0],
                    f'left_wheel_vel_{k}': [2.0, 2.1], f'right_wheel_vel_{k}': [4.0, 4.1],
                    f'icp_x_{k}': [0.02 * k] * 2, f'icp_y_{k}': [0.0, 0.0],
                    f'icp_yaw_{k}': [0.0, 0.0], f'imu_yaw_{k}': [0.3, 0.3],
                    f'imu_acceleration_x_{k}': [0.0, 0.0],
                    f'imu_acceleration_y_{k}': [0.0, 0.0]}
    columns |= {'gt_icp_x': [0.8, 0.8], 'gt_icp_y': [0.0, 0.0],
                'gt_icp_yaw': [0.5 * np.pi, 0.5 * np.pi]}
    streams = read_drive(write(pandas, tmp_path / 'torch.pkl', columns)).streams
    np.testing.assert_allclose(streams['command'].values[0], [0.165 * 3.0, 0.165 * 2.0 / 0.555])
    pose = streams['pose']
    assert pose.times[-1] == pytest.approx(3.95)
    # The second window starts at the end of the first, turned by a quarter turn.
    np.testing.assert_allclose(pose.values[40], [0.8, 0.0, 0.5 * np.pi], atol=1e-12)
    np.testing.assert_allclose(pose.values[-1], [0.8, 0.78, 0.5 * np.pi], atol=1e-12)


def test_the_command_writes_a_bag(pandas: types.SimpleNamespace, tmp_path: Path,
                                  capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip('rosbags')
    path = write(pandas, tmp_path / 'raw.pkl', raw())
    out = tmp_path / 'bag'
    assert run(['import', 'drive', str(path), '--out', str(out)]) == 0
    assert 'command 180' in capsys.readouterr().out
    recording = read_recording(out)
    assert len(segments(recording)) == 1
    np.testing.assert_allclose(recording.streams['command'].values[0], [0.4, 0.1])
    assert run(['import', 'drive', str(path), '--out', str(out)]) == 1
    assert 'exists already' in capsys.readouterr().err


def test_code_in_a_pickle_does_not_run(tmp_path: Path) -> None:
    mark = tmp_path / 'ran'
    for function, arguments, name in (
            (os.system, (f'touch {mark}',), 'system'), (eval, ('1',), 'eval'),
            (np.load, ('x',), 'load'), (np.ndarray.tofile, (np.zeros(1), str(mark)), 'getattr')):
        path = tmp_path / 'evil.pkl'
        path.write_bytes(pickle.dumps(Call(function, *arguments)))
        with pytest.raises(RecordingError, match=name):
            read_columns(path)
    assert not mark.exists()


def test_stand_ins_do_not_prepare_other_calls(tmp_path: Path) -> None:
    import functools
    path = tmp_path / 'partial.pkl'
    path.write_bytes(pickle.dumps(Call(functools.partial, np.dtype)))
    with pytest.raises(RecordingError, match='not that of a block'):
        read_columns(path)


#: A pair of nothing twice, of that pair twice, and so on: short here, written out it is endless.
PAIRS = b')' + b'2\x86' * 60


@pytest.mark.parametrize(('pickled', 'message'), [
    # 22 GB of bytes, a name with 4 billion places before it: memory for either.
    (b'\x80\x05\x96\x00\x00\x00\x40\x05\x00\x00\x00abc.', 'announces 22548578304 bytes'),
    (b'\x80\x04]r\xff\xff\xff\xff.', 'not a pickled table'),
    # The insides of a dtype, as numpy itself would believe them.
    (pickle.dumps(np.dtype([('a', 'f8')])), 'not one of numbers|not a pickled table'),
    # An array of another size than its values, and of anything but numbers and texts.
    (pickle.dumps(np.zeros(3)).replace(b'K\x03\x85', b'K\x7f\x85'), 'another size'),
    (pickle.dumps(np.zeros(3, dtype='M8[s]')), 'not numbers and texts|not one of numbers'),
    (b'\x80\x04\x8e\x01', 'not a pickled table'),
    # The state of a function.
    (b'\x80\x04cnumpy._core.multiarray\n_reconstruct\n}b.', 'changes something'),
    # 4 GB for a buffer that is a number.
    (b'\x80\x04cnumpy._core.numeric\n_frombuffer\n(J\x00\x00\x00\x7fcnumpy\ndtype\n(\x8c\x02u1tR'
     b'J\x00\x00\x00\x7f\x85\x8c\x01CtR.', 'another size'),
    # Pairs of pairs of pairs: as a key, as a name of a dtype, as a cell, in a set.
    (b'\x80\x04}' + PAIRS + b'K\x01s.', 'mapping from something else'),
    (b'\x80\x04}(' + PAIRS + b'K\x01u.', 'mapping from something else'),
    (b'\x80\x04(' + PAIRS + b'K\x01d.', 'mapping from something else'),
    (b'\x80\x04cnumpy\ndtype\n' + PAIRS + b'\x85R.', 'not one of numbers'),
    (pickle.dumps(np.array([None, 'x'], dtype=object)).replace(b'\x8c\x01x', PAIRS),
     'holds a tuple among'),
    (b'\x80\x04\x8f(' + PAIRS + b'\x90.', 'not a pickled table'),
    # What a table holds is no mapping either.
    (pickle.dumps(np.zeros(1, dtype=object))[:-1] + b'K\x00)s.', 'mapping from something else'),
    (pickle.dumps(np.array([1 << 5000, None], dtype=object)), 'a number of 5001 bits'),
    # A name of two lines.
    (b'\x80\x04\x8c\x05numpy\x8c\x05l\noad\x93.', r"names 'numpy\.l\\noad', which"),
])
def test_a_hostile_pickle_takes_no_memory_and_ends_no_process(
        tmp_path: Path, pickled: bytes, message: str) -> None:
    path = tmp_path / 'x.pkl'
    path.write_bytes(pickled)
    tracemalloc.start()
    with pytest.raises(RecordingError, match=message):
        read_columns(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 20_000_000


@pytest.mark.parametrize('content', [b'', b'\x80\x05', b'text', pickle.dumps({'a': 1}),
                                     pickle.dumps([1, 2])])
def test_other_files_are_refused_in_one_line(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / 'x.pkl'
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=r'x\.pkl: ') as caught:
        read_columns(path)
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize('stamp', ['10\x10', 'inf', '1.5.2', '-5', '9' * 30, ''])
def test_a_stamp_that_is_none_is_shown(
        pandas: types.SimpleNamespace, tmp_path: Path, stamp: str) -> None:
    columns = raw()
    columns['ros_time'][100] = stamp
    path = write(pandas, tmp_path / 'raw_dataframe.pkl', columns)
    with pytest.raises(RecordingError, match='is not a stamp in nanoseconds'):
        read_drive(path)


def test_missing_columns_and_robots_are_named(pandas: types.SimpleNamespace, tmp_path: Path
                                              ) -> None:
    columns = raw()
    del columns['meas_left_vel']
    with pytest.raises(RecordingError, match='no column meas_left_vel'):
        read_drive(write(pandas, tmp_path / 'a.pkl', columns))
    with pytest.raises(RecordingError, match='neither a raw nor a processed run'):
        read_drive(write(pandas, tmp_path / 'b.pkl', {'x': ['1', '2']}))
    with pytest.raises(RecordingError, match=r"^column cmd_vel_x: 'fast' is not a number$"):
        read_drive(write(pandas, tmp_path / 'c.pkl', raw() | {'cmd_vel_x': ['fast'] * 200}))
    with pytest.raises(RecordingError, match=r"columns: 'x\\ny', …$"):
        read_drive(write(pandas, tmp_path / 'd.pkl', {'x\ny': ['1', '2']}))
    with pytest.raises(SettingsError, match='there are husky, warthog'):
        read_drive(tmp_path / 'a.pkl', 'jackal')
