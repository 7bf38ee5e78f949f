# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The wheel carries every module and data file, works away from the source, and colcon's needs."""

from __future__ import annotations

import json
import os
from pathlib import Path
import re
import shutil
import subprocess
import sys
from xml.etree import ElementTree
import zipfile

from lg_husky_sim.jit import SWITCH
import pytest

ROOT = Path(__file__).resolve().parent.parent
DATA_FOLDERS = [name for name in ('config', 'urdf') if (ROOT / name).is_dir()]
SOURCE = ['setup.py', 'setup.cfg', 'pyproject.toml', 'package.xml', 'README.md', 'LICENSE',
          'resource', 'lg_husky_sim', 'launch', *DATA_FOLDERS]
ROSDEP_KEYS = {'pyyaml': 'python3-yaml', 'setuptools': None}


def files_below(folder: Path) -> set[str]:
    return {path.relative_to(folder.parent).as_posix() for path in folder.rglob('*')
            if path.is_file() and '__pycache__' not in path.parts
            and not path.name.endswith('.tmp')}


@pytest.fixture(scope='module')
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Copy what the package is made of, so that building leaves nothing beside it."""
    source = tmp_path_factory.mktemp('source')
    for name in SOURCE:
        path = ROOT / name
        if path.is_dir():
            shutil.copytree(path, source / name,
                            ignore=shutil.ignore_patterns('__pycache__', '*.tmp'))
        elif path.is_file():
            shutil.copy2(path, source / name)
    return source


@pytest.fixture(scope='module')
def wheel(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build a wheel without a network."""
    before = {path for path in source.rglob('*') if path.is_file()}
    built = tmp_path_factory.mktemp('wheel')
    build = 'import sys; from setuptools import build_meta; build_meta.build_wheel(sys.argv[1])'
    done = subprocess.run([sys.executable, '-c', build, str(built)], cwd=source, text=True,
                          capture_output=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    for path in {path for path in source.rglob('*') if path.is_file()} - before:
        path.unlink()
    return next(built.glob('*.whl'))


def test_wheel_holds_every_module_and_data_file_and_nothing_else(
        source: Path, wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        inside = {name for name in archive.namelist()
                  if not name.split('/')[0].endswith(('.dist-info', '.data'))}
    expected = files_below(source / 'lg_husky_sim')
    for folder in DATA_FOLDERS:
        expected |= {f'lg_husky_sim/{name}' for name in files_below(source / folder)}
    assert sorted(inside) == sorted(expected)


def test_wheel_registers_the_package_and_its_programs(source: Path, wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        entry_points = next(name for name in names if name.endswith('entry_points.txt'))
        programs = archive.read(entry_points).decode()
    assert 'sim_node = lg_husky_sim.ros.sim_node:main' in programs
    assert 'lg_husky = lg_husky_sim.cli.main:main' in programs
    shared = {name.split('.data/data/')[1] for name in names if '.data/data/' in name}
    assert 'share/ament_index/resource_index/packages/lg_husky_sim' in shared
    assert 'share/lg_husky_sim/package.xml' in shared
    for folder in DATA_FOLDERS:
        assert {f'share/lg_husky_sim/{name}' for name in files_below(source / folder)} <= shared


def test_installed_package_finds_its_own_files_away_from_the_source(
        wheel: Path, tmp_path: Path) -> None:
    site = tmp_path / 'site'
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
    ask = ('import sys; sys.path.insert(0, sys.argv[1])\n'
           'from lg_husky_sim.resources import config_path\n'
           'print(config_path("husky.yaml"))')
    done = subprocess.run([sys.executable, '-c', ask, str(site)], cwd=tmp_path, text=True,
                          capture_output=True, timeout=60, check=True)
    found = Path(done.stdout.strip())
    assert found == site / 'lg_husky_sim' / 'config' / 'husky.yaml'
    assert found.read_bytes() == (ROOT / 'config' / 'husky.yaml').read_bytes()


def test_the_wheel_simulates_reads_and_compares_away_from_the_source(
        wheel: Path, tmp_path: Path) -> None:
    site = tmp_path / 'site'
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
    ask = ('import sys; sys.path.insert(0, sys.argv[1])\n'
           'import lg_husky_sim as lg\n'
           'assert lg.__file__.startswith(sys.argv[1])\n'
           'bag = lg.Husky().simulate("straight").save("bag")\n'
           'page = lg.compare(lg.read(bag)).save("out", figures=1)\n'
           'print(lg.read(bag).info().verdict, page)')
    # In plain Python: machine code would be compiled anew for a folder that is gone afterwards.
    done = subprocess.run([sys.executable, '-P', '-c', ask, str(site)], cwd=tmp_path, text=True,
                          capture_output=True, timeout=120, check=False,
                          env={**os.environ, SWITCH: '1'})
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stdout.startswith('Not enough for a diagnosis.')  # nine seconds straight ahead
    assert (tmp_path / 'out' / 'index.html').is_file()


def test_versions_agree() -> None:
    version = arguments_of_setup()['version']
    citation = (ROOT / 'CITATION.cff').read_text(encoding='utf-8')
    assert f'\nversion: {version}\n' in citation


def test_the_lock_file_names_packages_and_no_place() -> None:
    lines = (ROOT / 'requirements.lock').read_text(encoding='utf-8').splitlines()
    pins = [line for line in lines if not line.startswith('#')]
    assert len(pins) > 50
    for line in pins:
        assert re.fullmatch(r'[a-z0-9-]+==[0-9][\w.+!]*', line), line
    locked = {line.partition('==')[0] for line in pins}
    assert {'numpy', 'scipy', 'sympy', 'rosbags', 'rich', 'pandas'} <= locked


def arguments_of_setup(folder: Path = ROOT) -> dict[str, object]:
    """Run setup.py of a folder with a recorder in setup()'s place."""
    ask = ('import json, runpy, setuptools\n'
           'setuptools.setup = lambda **kw: print(json.dumps(kw))\n'
           'runpy.run_path("setup.py")')
    done = subprocess.run([sys.executable, '-c', ask], cwd=folder, text=True,
                          capture_output=True, timeout=60, check=True)
    arguments = json.loads(done.stdout)
    assert isinstance(arguments, dict)
    return arguments


def test_setup_runs_as_a_link_in_another_folder(tmp_path: Path) -> None:
    """As colcon build --symlink-install runs it."""
    for name in ('setup.py', 'lg_husky_sim'):
        (tmp_path / name).symlink_to(ROOT / name)
    linked, direct = arguments_of_setup(tmp_path), arguments_of_setup()
    assert linked == direct
    assert 'lg_husky_sim.ros' in str(linked['packages'])


def test_package_xml_says_what_setup_says() -> None:
    arguments = arguments_of_setup()
    manifest = ElementTree.parse(ROOT / 'package.xml').getroot()
    assert manifest.findtext('name') == arguments['name']
    assert manifest.findtext('version') == arguments['version']
    assert manifest.findtext('license') == arguments['license'] == 'Apache-2.0'
    assert manifest.findtext('export/build_type') == 'ament_python'
    declared = {element.text for element in manifest.iter('exec_depend')}
    needs = arguments['install_requires']
    assert isinstance(needs, list)
    for need in needs:
        name = need.split('>')[0]
        key = ROSDEP_KEYS.get(name, f'python3-{name}')
        assert key is None or key in declared, f'{name} is missing in package.xml'
    assert {'rclpy', 'geometry_msgs', 'nav_msgs', 'sensor_msgs', 'std_srvs'} <= declared
