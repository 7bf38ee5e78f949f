# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Sound inputs of every reader, and what a reading must hold that was not refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import math
from pathlib import Path
import pickle
import tempfile
from typing import Any

from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.evaluation.drive_dataset import read_drive
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model_file import load_model, ModelFile, save_model
from lg_husky_sim.husky.model_reader import MOST_ERRORS
from lg_husky_sim.linear_graph import compile_numeric
from lg_husky_sim.linear_graph.netlist import parse_netlist
from lg_husky_sim.manoeuvres import load_manoeuvre
from lg_husky_sim.recording import read_recording, Recording, segments
from lg_husky_sim.recording.writer import write_recording
from lg_husky_sim.resources import config_path
from lg_husky_sim.ros import api, conversions
from lg_husky_sim.ros.embedded.arguments import parse
from lg_husky_sim.ros.embedded.messages import deserialise, serialise
from lg_husky_sim.ros.occupancy import map_from_msg, read_map
from lg_husky_sim.signals import TimeSeries
import numpy as np
from rosbags.serde import SerdeError

SCRIPT = """schema: lg_husky_sim/commands/1
about: a left turn
rate: 20
steps:
  - {duration: 2.0, forward: 0.5, yaw: 0.0, ramp: 0.5}
  - {duration: 3.0, forward: 0.5, yaw: 0.4}
"""
MAP = """image: map.pgm
resolution: 0.05
origin: [-1.0, -2.0, 0.3]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
mode: trinary
"""
MESSAGES = ('geometry_msgs/msg/Twist', 'geometry_msgs/msg/TwistStamped', 'nav_msgs/msg/Odometry',
            'sensor_msgs/msg/JointState', 'sensor_msgs/msg/Imu', 'tf2_msgs/msg/TFMessage',
            'geometry_msgs/msg/PoseWithCovarianceStamped', 'nav_msgs/msg/OccupancyGrid',
            'rcl_interfaces/msg/ParameterEvent', 'rosgraph_msgs/msg/Clock')


class WrongError(AssertionError):
    """A reading that was not refused and makes no sense."""


def sensible(truth: object, text: str) -> None:
    """Raise that a reading makes no sense, unless it does."""
    if not truth:
        raise WrongError(text)


@dataclass(frozen=True)
class Reader:
    """
    A reader under test.

    Parameters
    ----------
    name : str
    seeds : callable
        Returns sound inputs; may put what goes with them into a folder.
    read : callable
        Reads an input (bytes, and a folder for files); raises what :attr:`refusals` names, or
        returns after having checked what was read.
    refusals : tuple of type
        What a bad input may raise.
    share : float
        Part of the inputs that this reader gets.
    text : bool
        Whether inputs are text, and lines and words are mutated as well.

    """

    name: str
    seeds: Callable[[Path], list[bytes]]
    read: Callable[[bytes, Path], None]
    refusals: tuple[type[Exception], ...] = (LgHuskyError,)
    share: float = 1.0
    text: bool = False


def _one_line(path: Path, read: Callable[[Path], Any], errors: int = 1) -> Any:
    """Read a file; an error must be one line of less than two thousand characters."""
    try:
        return read(path)
    except LgHuskyError as error:
        lines = str(error).splitlines()
        sensible(len(lines) <= errors and max(map(len, lines)) < 2000, f'message: {error}')
        raise


def _written(folder: Path, name: str, data: bytes) -> Path:
    path = folder / name
    path.write_bytes(data)
    return path


# --- bags ---------------------------------------------------------------------------------------


def drive() -> dict[str, TimeSeries]:
    """Return a short drive: commands, wheels, IMU and pose."""
    times = np.arange(0.0, 1.0, 0.05)
    turn = np.sin(times)
    return {
        'command': TimeSeries(times, np.stack([0.5 + 0 * times, turn], 1), ('forward', 'yaw')),
        'wheels': TimeSeries(times, np.stack([3.0 + turn, 3.0 - turn], 1), ('left', 'right')),
        'imu': TimeSeries(times, np.stack([turn, 0.1 * turn, 0 * turn], 1),
                          ('yaw_rate', 'accel_x', 'accel_y')),
        'pose': TimeSeries(times, np.stack([0.5 * times, turn, turn], 1), ('x', 'y', 'heading')),
    }


def _bag(storage: str) -> Callable[[Path], list[bytes]]:
    def seeds(folder: Path) -> list[bytes]:
        path = write_recording(folder / 'bag', drive(), storage=storage)
        return [_storage(path).read_bytes()]
    return seeds


def _metadata(folder: Path) -> list[bytes]:
    path = write_recording(folder / 'bag', drive())
    return [(path / 'metadata.yaml').read_bytes()]


def _ros1(folder: Path) -> list[bytes]:
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import get_typestore, Stores
    store = get_typestore(Stores.ROS1_NOETIC)
    types: Any = store.types
    path = folder / 'seed.bag'
    with Writer(path) as writer:
        twist = writer.add_connection('/cmd_vel', 'geometry_msgs/msg/Twist', typestore=store)
        joints = writer.add_connection('/joint_states', 'sensor_msgs/msg/JointState',
                                       typestore=store)
        for k in range(20):
            now = 1_700_000_000_000_000_000 + k * 50_000_000
            none, ahead = (types['geometry_msgs/msg/Vector3'](x, 0.0, 0.0) for x in (0.0, 0.5))
            command = types['geometry_msgs/msg/Twist'](ahead, none)
            writer.write(twist, now, store.serialize_ros1(command, 'geometry_msgs/msg/Twist'))
            header = types['std_msgs/msg/Header'](
                k, types['builtin_interfaces/msg/Time'](*divmod(now, 10**9)), '')
            state = types['sensor_msgs/msg/JointState'](
                header, ['left_wheel', 'right_wheel'], np.array([0.1 * k, 0.1 * k]),
                np.array([2.0, 2.0]), np.zeros(0))
            writer.write(joints, now, store.serialize_ros1(state, 'sensor_msgs/msg/JointState'))
    return [path.read_bytes()]


def _storage(path: Path) -> Path:
    return next(part for part in path.iterdir() if part.suffix in ('.mcap', '.db3'))


def _check_recording(recording: Recording) -> None:
    for name, series in recording.streams.items():
        sensible(np.all(np.isfinite(series.values)), f'{name} holds what is not finite')
        sensible(np.all(np.diff(series.times) > 0.0), f'stamps of {name} do not ascend')
    segments(recording)


def _read_storage(data: bytes, folder: Path) -> None:
    _storage(folder / 'bag').write_bytes(data)
    _check_recording(_one_line(folder / 'bag', read_recording))


def _read_metadata(data: bytes, folder: Path) -> None:
    _written(folder / 'bag', 'metadata.yaml', data)
    _check_recording(_one_line(folder / 'bag', read_recording))


def _read_ros1(data: bytes, folder: Path) -> None:
    _check_recording(_one_line(_written(folder, 'one.bag', data), read_recording))


# --- YAML ---------------------------------------------------------------------------------------


def _models(folder: Path) -> list[bytes]:
    nominal = load_model()
    structure = nominal.structure
    for effect in (Effect('battery_sag'), Effect('torque_ripple', 'left'),
                   Effect('command_latency')):
        structure = structure.with_effect(effect)
    own = [p.parameter() for effect in structure.effects for p in effect.parameters()]
    path = folder / 'seed.yaml'
    save_model(ModelFile(structure, nominal.parameters.with_entries(*own)), path)
    return [path.read_bytes(), config_path('husky.yaml').read_bytes()]


def _read_model(data: bytes, folder: Path) -> None:
    # Several errors are listed, one a line.
    model = _one_line(_written(folder, 'one.yaml', data), load_model, MOST_ERRORS + 2)
    for name, value in model.parameters.items():
        entry = model.parameters.entry(name)
        sensible(math.isfinite(value) and entry.lower <= value <= entry.upper,
                 f'{name} = {value} is beyond its bounds')
    save_model(model, folder / 'again.yaml')
    again = load_model(folder / 'again.yaml')
    sensible(again.structure == model.structure and dict(again.parameters) == dict(
        model.parameters), 'what was written is read as something else')


def _netlists(_: Path) -> list[bytes]:
    from lg_husky_sim.linear_graph import netlist
    root = Path(netlist.__file__).resolve().parents[2]
    folder = root / 'examples' / 'linear_graph'
    return [path.read_bytes() for path in sorted(folder.glob('*.yaml'))]


def _read_netlist(data: bytes, folder: Path) -> None:
    try:
        text = data.decode()
    except UnicodeDecodeError:
        return
    one = parse_netlist(text)
    model = compile_numeric(one.graph, one.outputs)
    # Most examples are for their formulas and give no numbers.
    space = model.at({**dict.fromkeys(model.parameters, 1.5), **one.values})
    sensible(all(np.all(np.isfinite(m)) for m in (space.A, space.B)), 'matrices not finite')


def _read_script(data: bytes, folder: Path) -> None:
    script = _one_line(_written(folder, 'one.yaml', data), load_manoeuvre)
    sensible(math.isfinite(script.duration), 'the duration is not finite')


def _maps(folder: Path) -> list[bytes]:
    (folder / 'map.pgm').write_bytes(b'P5 8 8 255\n' + bytes(range(64)))
    return [MAP.encode()]


def _read_map_file(data: bytes, folder: Path) -> None:
    _look(read_map(str(_written(folder, 'map.yaml', data)), 60))


def _images(folder: Path) -> list[bytes]:
    (folder / 'map.yaml').write_text(MAP, encoding='utf-8')
    words = ' '.join(str(4 * k) for k in range(64))
    return [b'P5\n# a map\n8 8\n255\n' + bytes(range(0, 256, 4)),
            f'P2 8 8 255\n{words}\n'.encode()]


def _read_image(data: bytes, folder: Path) -> None:
    (folder / 'map.pgm').write_bytes(data)
    _look(read_map(str(folder / 'map.yaml'), 60))


def _look(grid: Any) -> None:
    """Cast rays from the middle: none may be negative or endless in time."""
    height, width = grid.cells.shape
    side = grid.resolution
    turn = grid.origin.heading
    x, y = 0.5 * width * side, 0.5 * height * side
    here = type(grid.origin)(
        grid.origin.x + x * math.cos(turn) - y * math.sin(turn),
        grid.origin.y + x * math.sin(turn) + y * math.cos(turn), 0.0)
    ranges = grid.ranges(here, np.linspace(-3.0, 3.0, 16), 30.0)
    sensible(np.all(ranges >= 0.0), 'a range is negative or no number')


def _parameters(folder: Path) -> list[bytes]:
    return [config_path('sim_node.yaml').read_bytes(), config_path('nav2.yaml').read_bytes()]


def _read_parameters(data: bytes, folder: Path) -> None:
    from lg_husky_sim.ros.settings import BY_NAME, make_settings
    path = _written(folder, 'one.yaml', data)
    rules = parse(['--ros-args', '--params-file', str(path)]).parameters
    make_settings({rule.name: rule.value for rule in rules if rule.name in BY_NAME})


# --- pickles, messages --------------------------------------------------------------------------


def _pickles(folder: Path) -> list[bytes]:
    import pandas
    rows = 12
    column = np.linspace(0.0, 1.0, rows)
    names = ('cmd_vel_x', 'cmd_vel_omega', 'meas_left_vel', 'meas_right_vel', 'icp_pos_x',
             'icp_pos_y', 'icp_quat_x', 'icp_quat_y', 'icp_quat_z', 'icp_quat_w', 'icp_index',
             'imu_z', 'imu_acceleration_x', 'imu_acceleration_y')
    frame = pandas.DataFrame({
        'ros_time': np.array([str(10**18 + 50_000_000 * k) for k in range(rows)], dtype=object),
        'calib_state': np.array(['calib'] * rows, dtype=object),
        **dict.fromkeys(names, column + 1.0)})
    # Texts as objects: how they were before pandas 3.
    frame.columns = pandas.Index(list(frame.columns), dtype=object)
    for name in ('ros_time', 'calib_state'):
        frame[name] = pandas.Series(list(frame[name]), dtype=object)
    return [pickle.dumps(frame, protocol=4)]


def _read_pickle(data: bytes, folder: Path) -> None:
    run = _one_line(_written(folder, 'one.pkl', data), read_drive)
    for name, series in run.streams.items():
        sensible(np.all(np.diff(series.times) >= 0.0), f'stamps of {name} run back')


def _filled(message: Any, depth: int = 0) -> Any:
    """Put numbers and texts into all fields of a message."""
    for k, field in enumerate(message._fields):
        value = getattr(message, field)
        if isinstance(value, str):
            setattr(message, field, 'base_link')
        elif isinstance(value, np.ndarray):
            setattr(message, field, np.arange(value.size or 4) % 100)
        elif hasattr(value, '_fields'):
            _filled(value, depth + 1)
        elif isinstance(value, float):
            setattr(message, field, 0.5 + k)
    return message


def _messages(folder: Path) -> list[bytes]:
    # The first byte says of which type the rest is.
    seeds = []
    for place, name in enumerate(MESSAGES):
        message = _filled(api.message_type(name)())
        if name.endswith('OccupancyGrid'):
            message.info.width = message.info.height = 2
        seeds.append(bytes([place]) + serialise(message))
    return seeds


def _read_message(data: bytes, folder: Path) -> None:
    if not data:
        return
    name = MESSAGES[data[0] % len(MESSAGES)]
    message: Any = deserialise(data[1:], name)
    again: Any = deserialise(serialise(message), name)
    sensible(serialise(again) == serialise(message), f'{name} is not the same when sent on')
    match name.rpartition('/')[2]:
        case 'Twist':
            conversions.twist_from_msg(message)
        case 'PoseWithCovarianceStamped':
            conversions.pose_from_msg(message.pose.pose)
        case 'OccupancyGrid':
            _look(map_from_msg(message, 60))


READERS = (
    Reader('bag, mcap', _bag('mcap'), _read_storage, share=3.0),
    Reader('bag, sqlite3', _bag('sqlite3'), _read_storage, share=3.0),
    Reader('bag, ROS 1', _ros1, _read_ros1, share=3.0),
    Reader('bag, metadata.yaml', _metadata, _read_metadata, share=2.0, text=True),
    Reader('model file', _models, _read_model, share=3.0, text=True),
    Reader('netlist', _netlists, _read_netlist, share=3.0, text=True),
    Reader('command script', lambda folder: [SCRIPT.encode()], _read_script, text=True),
    Reader('map, YAML', _maps, _read_map_file, text=True),
    Reader('map, PGM', _images, _read_image),
    Reader('ROS parameters', _parameters, _read_parameters, text=True),
    Reader('pickle of DRIVE', _pickles, _read_pickle, share=1.0),
    Reader('message, CDR', _messages, _read_message, (LgHuskyError, SerdeError), share=3.0),
)


def prepared(reader: Reader) -> tuple[Path, list[bytes]]:
    """Return a folder of a reader's own and its sound inputs; all of them are read."""
    folder = Path(tempfile.mkdtemp(dir='/dev/shm' if Path('/dev/shm').is_dir() else None))
    seeds = reader.seeds(folder)
    for seed in seeds:
        reader.read(seed, folder)
    return folder, seeds
