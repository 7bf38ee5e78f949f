# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Cases are the same bit for bit, their bags are the robot's, and answers stay sealed."""

from __future__ import annotations

import ast
from dataclasses import replace
import json
from pathlib import Path
import sys
from typing import Any

from lg_husky_sim.errors import CommandError, LgHuskyError, RecordingError
from lg_husky_sim.proof import catalogue, plan
from lg_husky_sim.proof.bags import Published, read_bag, write_bag
from lg_husky_sim.proof.cases import choose, generate, Spec
from lg_husky_sim.proof.sealing import commitment, seal, unseal
from lg_husky_sim.recording import read_recording
import numpy as np
import pytest

PROOF = Path(__file__).resolve().parents[2] / 'lg_husky_sim' / 'proof'
ALLOWED = {'numpy', 'scipy', 'mujoco', 'numba', 'rosbags', 'yaml', 'matplotlib',
           'pybullet', 'lg_husky_sim.errors', 'lg_husky_sim.parallel', 'lg_husky_sim.resources',
           'lg_husky_sim.yaml_files'}


def test_the_generator_shares_no_code_with_what_it_judges() -> None:
    files = sorted(PROOF.glob('*.py'))
    assert len(files) > 15
    for path in files:
        for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                assert node.level == 0, f'{path.name} has a relative import'
                names = [str(node.module)]
                if node.module == 'lg_husky_sim':
                    names = [f'lg_husky_sim.{alias.name}' for alias in node.names]
            else:
                continue
            for name in names:
                own = name == 'lg_husky_sim.proof' or name.startswith('lg_husky_sim.proof.')
                root = name.split('.')[0]
                assert (own or name in ALLOWED or root in sys.stdlib_module_names
                        or (root in ALLOWED and root != 'lg_husky_sim')), \
                    f'{path.name} imports {name}'


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes()
            for path in sorted(folder.rglob('*')) if path.is_file()}


def make(folder: Path, spec: Spec) -> str:
    return generate(spec, 'case_0001', folder / 'cases', folder / 'answers', folder / 'held')


def answer_of(folder: Path) -> dict[str, Any]:
    loaded: dict[str, Any] = json.loads(
        (folder / 'answers/case_0001.json').read_text(encoding='utf-8'))
    return loaded


SLOPE = Spec(42, 'single', effects=('slope',), severity='strong', onset='place', drive='joystick',
             wheels='difference', floor='smooth', seconds=(10.0, 11.0), complete=True)


@pytest.fixture(scope='module')
def single(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp('single')
    make(folder, SLOPE)
    return folder


def test_the_same_seed_gives_the_same_case_bit_for_bit(single: Path, tmp_path: Path) -> None:
    make(tmp_path, SLOPE)
    first, again = contents(single), contents(tmp_path)
    assert first.keys() == again.keys()
    assert [name for name in first if first[name] != again[name]] == []
    assert not list(tmp_path.rglob('*.part'))


def test_another_seed_gives_another_robot(single: Path, tmp_path: Path) -> None:
    make(tmp_path, replace(SLOPE, seed=43))
    one, other = answer_of(single), answer_of(tmp_path)
    assert one['true_parameters']['mass'] != other['true_parameters']['mass']
    assert one['salt'] != other['salt']
    # The date tells nothing of the seed.
    bags = [read_recording(folder / 'cases/case_0001/rec1') for folder in (single, tmp_path)]
    assert abs(bags[0].start_ns - bags[1].start_ns) < 10**9


def test_an_answer_has_what_the_marks_need(single: Path) -> None:
    answer = answer_of(single)
    assert (answer['kind'], answer['level']) == ('single', 'clear')
    (true,) = answer['answers']
    assert true['effect'] == 'slope'
    assert true['in_list'] is True
    assert true['location']['subsystem'] == 'translation'
    assert true['onset']['type'] == 'place'
    assert set(answer['robot']) == {'wheel_radius_m', 'track_m'}
    assert set(answer['regime']) >= {'floor', 'colour', 'wheels', 'stamps', 'jitter', 'noise'}
    assert answer['true_parameters']['gravity_x'] != 0.0


def test_a_bag_is_of_one_robot_s_motion(single: Path) -> None:
    answer = answer_of(single)
    bag = read_bag(single / 'cases/case_0001/rec1')
    for name, rate in (('joints', answer['conventions']['wheels']['rate']),
                       ('imu', answer['conventions']['gyro']['rate']),
                       ('poses', answer['conventions']['poses']['rate'])):
        assert np.median(np.diff(bag[name][:, 0])) == pytest.approx(1.0 / rate, rel=0.25)
    imu, poses = bag['imu'], bag['poses']
    angle = np.concatenate([[0.0], np.cumsum(imu[1:, 1] * np.diff(imu[:, 0]))])
    both = np.interp(poses[:, 0], imu[:, 0], angle)
    assert both - both[0] == pytest.approx(poses[:, 3] - poses[0, 3], abs=0.2)
    assert np.ptp(poses[:, 3]) > 0.5


def test_held_out_truth_fits_its_recording_within_noise(single: Path) -> None:
    held = read_bag(single / 'held/case_0001/held1')
    truth = read_bag(single / 'held/case_0001/truth1')
    gap = held['imu'][:, 1] - np.interp(held['imu'][:, 0], truth['imu'][:, 0], truth['imu'][:, 1])
    noise = answer_of(single)['conventions']['gyro']['noise']
    assert np.sqrt(np.mean(gap ** 2)) < 0.02 + 2.0 * noise
    recording = read_bag(single / 'cases/case_0001/rec1')
    assert held['joints'][0, 0] > recording['joints'][-1, 0]


def test_a_robot_that_changed_comes_with_recordings_of_before(tmp_path: Path) -> None:
    make(tmp_path, Spec(7, 'single', 'g3', effects=('payload',), severity='strong',
                        seconds=(10.0, 11.0)))
    for part in ('before', 'after'):
        names = sorted(path.name for path in (tmp_path / 'cases/case_0001' / part).iterdir())
        assert names == ['rec1', 'rec2', 'rec3']
    answer = answer_of(tmp_path)
    assert answer['kind'] == 'before_after'
    assert answer['answers'][0]['effect'] == 'payload'
    assert answer['answers'][0]['onset'] == {'type': 'set'}
    assert answer['true_parameters']['loop'] == 1.0


@pytest.mark.parametrize(('stream', 'topic'), [
    ('wheels', '/joint_states'), ('imu', '/imu_um7/data'), ('pose', '/tf')])
def test_a_stream_that_is_missing_is_not_in_the_bag(tmp_path: Path, stream: str,
                                                    topic: str) -> None:
    from rosbags.rosbag2 import Reader
    full = Published(np.array([[0.0, 0.5, 0.0], [0.1, 0.5, 0.0]]), np.zeros((2, 9)),
                     np.zeros((2, 4)), np.zeros((2, 4)), positions=False)
    field = {'wheels': 'joints', 'imu': 'imu', 'pose': 'poses'}[stream]
    missing: dict[str, Any] = {field: np.zeros((0, 9))}
    write_bag(tmp_path / 'rec1', replace(full, **missing), 10 ** 18)
    with Reader(tmp_path / 'rec1') as reader:
        topics = {connection.topic for connection in reader.connections}
    assert topic not in topics
    assert len(topics) == 3


def test_what_is_not_a_rosbag_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / 'metadata.yaml').write_text('a: [')
    with pytest.raises(RecordingError, match='cannot be read'):
        read_bag(tmp_path)


def test_an_answer_that_was_changed_is_found_out(tmp_path: Path) -> None:
    path = tmp_path / 'answer.json'
    published = seal(path, {'salt': 'x', 'effects': ['slope'], 'size': 0.1})
    assert unseal(path, published)['effects'] == ['slope']
    path.write_text(path.read_text().replace('slope', 'payload'))
    with pytest.raises(LgHuskyError, match=r'answer answer\.json has commitment'):
        unseal(path, published)


def test_the_salt_hides_the_answer() -> None:
    assert commitment({'effects': [], 'salt': 'a'}) != commitment({'effects': [], 'salt': 'b'})


@pytest.mark.parametrize(('field', 'value'), [
    ('kind', 'triple'), ('world', 'g9'), ('drive', 'rally'), ('severity', 'huge'),
    ('onset', 'later')])
def test_a_wrong_word_in_a_spec_names_what_is_allowed(field: str, value: str) -> None:
    with pytest.raises(CommandError, match=f"{field} = '{value}' is none of"):
        replace(Spec(1), **{field: value})  # type: ignore[arg-type]


def test_pairs_join_different_subsystems() -> None:
    for seed in range(40):
        names, levels = choose(Spec(seed, 'pair'), np.random.default_rng(seed))
        assert len(names) == len(levels) == 2
        assert catalogue.subsystem(names[0]) != catalogue.subsystem(names[1])


def test_a_plan_covers_the_catalogue_the_floors_and_the_sensors_evenly() -> None:
    specs = plan.plan(300, 10_000, tuning=False)
    singles = [spec.effects[0] for spec in specs if spec.kind == 'single']
    counts = [singles.count(name) for name in catalogue.SUBSYSTEM]
    assert max(counts) - min(counts) <= 1
    assert {spec.kind for spec in specs} == {'single', 'clean', 'pair', 'outside'}
    assert [spec.seed for spec in specs] == list(range(10_000, 10_300))
    assert plan.plan(300, 10_000, tuning=False) == specs
    for axis in ('floor', 'wheels'):
        drawn = [getattr(spec, axis) for spec in specs if spec.kind == 'clean']
        assert max(map(drawn.count, drawn)) - min(map(drawn.count, drawn)) <= 1
    assert {spec.wheels for spec in specs} > {spec.wheels for spec in plan.plan(300, 1)}
    worlds = {spec.world for spec in plan.plan(300, 10_000, 'mix', tuning=False)}
    assert worlds == {'g1', 'g2', 'g3', 'g4'}
    assert {spec.world for spec in plan.plan(300, 1, 'mix')} == {'g1', 'g2', 'g3'}
    with pytest.raises(CommandError, match='world g4 is left out of tuning'):
        plan.plan(3, 1, 'g4')


@pytest.mark.parametrize(('seed', 'cases', 'report'), [
    (9_990, 20, False), (9_999, 1, True), (77_990, 20, True)])
def test_tuning_and_reporting_seeds_never_meet_and_reports_are_spent(
        seed: int, cases: int, report: bool) -> None:
    with pytest.raises(CommandError, match='seed'):
        plan.check_seeds(seed, cases, report)
    plan.check_seeds(9_980, 20, report=False)
    plan.check_seeds(10_000, 20, report=True)
