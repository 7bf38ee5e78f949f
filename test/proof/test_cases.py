# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Cases are the same bit for bit, their bags are the robot's, and answers stay sealed."""

from __future__ import annotations

import ast
from dataclasses import replace
import json
from pathlib import Path
import sys

from lg_husky_sim.errors import CommandError, LgHuskyError, RecordingError
from lg_husky_sim.proof import catalogue, plan
from lg_husky_sim.proof.bags import read_bag
from lg_husky_sim.proof.cases import choose, generate, Spec
from lg_husky_sim.proof.sealing import commitment, seal, unseal
from lg_husky_sim.recording import read_recording
import numpy as np
import pytest

PROOF = Path(__file__).resolve().parents[2] / 'lg_husky_sim' / 'proof'
ALLOWED = {'numpy', 'scipy', 'mujoco', 'numba', 'rosbags', 'yaml', 'matplotlib',
           'lg_husky_sim.errors'}


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


@pytest.fixture(scope='module')
def single(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp('single')
    make(folder, Spec(42, 'single', effects=('slope',), severity='strong', onset='place'))
    return folder


def test_the_same_seed_gives_the_same_case_bit_for_bit(single: Path, tmp_path: Path) -> None:
    make(tmp_path, Spec(42, 'single', effects=('slope',), severity='strong', onset='place'))
    first, again = contents(single), contents(tmp_path)
    assert first.keys() == again.keys()
    assert [name for name in first if first[name] != again[name]] == []
    assert not list(tmp_path.rglob('*.part'))


def test_another_seed_gives_another_robot(single: Path, tmp_path: Path) -> None:
    make(tmp_path, Spec(43, 'single', effects=('slope',), severity='strong', onset='place'))
    one = json.loads((single / 'answers/case_0001.json').read_text())
    other = json.loads((tmp_path / 'answers/case_0001.json').read_text())
    assert one['robot']['mass'] != other['robot']['mass']
    assert one['salt'] != other['salt']
    # The date tells nothing of the seed.
    bags = [read_recording(folder / 'cases/case_0001/recordings/rec1')
            for folder in (single, tmp_path)]
    assert abs(bags[0].start_ns - bags[1].start_ns) < 10**9


def test_a_bag_has_the_husky_s_topics_rates_and_consistent_motion(single: Path) -> None:
    bag = read_bag(single / 'cases/case_0001/recordings/rec1')
    for name in ('joints', 'imu'):
        assert np.median(np.diff(bag[name][:, 0])) == pytest.approx(0.02, abs=1e-3)
    assert 0.015 < np.median(np.diff(bag['poses'][:, 0])) < 0.06
    assert bag['commands'].shape[1] == 3
    turned = bag['poses'][-1, 3] - bag['poses'][0, 3]
    imu = bag['imu']
    by_gyro = float(np.sum(imu[1:, 1] * np.diff(imu[:, 0])))
    assert abs(turned) > 4.0
    assert by_gyro == pytest.approx(turned, abs=0.1)
    joints = bag['joints']
    assert abs(joints[:40, 1:]).max() < 0.3, 'the robot starts at rest (up to encoder ticks)'


def test_held_out_truth_fits_its_recording_within_noise(single: Path) -> None:
    held = read_bag(single / 'held/case_0001/held1')
    truth = read_bag(single / 'held/case_0001/truth1')
    gap = held['imu'][:, 1] - np.interp(held['imu'][:, 0], truth['imu'][:, 0], truth['imu'][:, 1])
    assert np.sqrt(np.mean(gap ** 2)) < 0.03
    recording = read_bag(single / 'cases/case_0001/recordings/rec1')
    assert held['joints'][0, 0] > recording['joints'][-1, 0]


def test_a_baseline_comes_with_a_robot_that_changed(tmp_path: Path) -> None:
    make(tmp_path, Spec(7, 'single', 'g3', effects=('payload',), severity='strong'))
    names = sorted(path.name for path in (tmp_path / 'cases/case_0001/baseline').iterdir())
    assert names == ['base1', 'base2', 'base3']
    answer = json.loads((tmp_path / 'answers/case_0001.json').read_text())
    assert answer['effects'][0]['effect'] == 'payload'
    assert answer['robot']['loop'] == 1.0


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
    ('kind', 'triple'), ('world', 'g9'), ('drive', 'slalom'), ('severity', 'huge'),
    ('onset', 'later')])
def test_a_wrong_word_in_a_spec_names_what_is_allowed(field: str, value: str) -> None:
    with pytest.raises(CommandError, match=f"{field} = '{value}' is none of"):
        replace(Spec(1), **{field: value})  # type: ignore[arg-type]


def test_pairs_join_different_subsystems() -> None:
    for seed in range(40):
        names, levels = choose(Spec(seed, 'pair'), np.random.default_rng(seed))
        assert len(names) == len(levels) == 2
        assert catalogue.subsystem(names[0]) != catalogue.subsystem(names[1])


def test_a_plan_covers_the_catalogue_evenly() -> None:
    specs = plan.plan(200, 10_000)
    singles = [spec.effects[0] for spec in specs if spec.kind == 'single']
    counts = [singles.count(name) for name in catalogue.SUBSYSTEM]
    assert max(counts) - min(counts) <= 1
    assert {spec.kind for spec in specs} == {'single', 'clean', 'pair', 'outside'}
    assert [spec.seed for spec in specs] == list(range(10_000, 10_200))
    assert plan.plan(200, 10_000) == specs


@pytest.mark.parametrize(('seed', 'cases', 'report'), [(9_990, 20, False), (9_999, 1, True)])
def test_tuning_and_reporting_seeds_never_meet(seed: int, cases: int, report: bool) -> None:
    with pytest.raises(CommandError, match='seed'):
        plan.check_seeds(seed, cases, report)
    plan.check_seeds(9_980, 20, report=False)
    plan.check_seeds(10_000, 20, report=True)
