# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The set-up of ./run and ./check: by uv where it is installed, otherwise by pip."""

from __future__ import annotations

import os
from pathlib import Path
import shutil
import subprocess
import sys

import pytest

ROOT = Path(__file__).resolve().parent.parent
SCRIPT = ROOT / 'scripts' / 'environment.sh'

#: Stands for python3: answers questions, makes an environment with itself in it, installs nothing.
PYTHON = """#!/bin/sh
[ "$1" = -c ] && exec {python} "$@"
[ "$1" = -V ] && exec {python} -V
echo "python $*" >> {log}
for last; do :; done
case "$*" in
    '-m venv'*) mkdir -p "$last/bin"; cp "$0" "$last/bin/python"
                echo "#!$last/bin/python" > "$last/bin/pip" ;;
    *'pip install'*) echo 'Successfully installed lg-husky-sim-0.1.0' ;;
esac
"""
#: Stands for uv: makes an environment with the python above; installs with a given exit code.
UV = """#!/bin/sh
echo "uv $*" >> {log}
for last; do :; done
case "$1" in
    venv) mkdir -p "$last/bin"; cp {fake} "$last/bin/python"
          echo "#!$last/bin/python" > "$last/bin/pip" ;;
    pip) exit {code} ;;
esac
"""


class SetUp:
    """A project and a PATH of its own, in which stand-ins write down how they are called."""

    def __init__(self, folder: Path) -> None:
        self.root, self.log, self.bin = folder / 'root', folder / 'log', folder / 'bin'
        self.root.mkdir()
        self.bin.mkdir()
        for name in ('setup.py', 'setup.cfg', 'pyproject.toml', 'package.xml'):
            (self.root / name).write_text('as it is\n')
        self.put('python3', PYTHON.format(python=sys.executable, log=self.log))

    def put(self, name: str, text: str) -> None:
        (self.bin / name).write_text(text)
        (self.bin / name).chmod(0o755)

    def put_uv(self, code: int = 0) -> None:
        self.put('uv', UV.format(log=self.log, fake=self.bin / 'python3', code=code))

    def run(self, **variables: str) -> tuple[list[str], str]:
        """Set up; return the calls of python and uv, and what was said."""
        self.log.write_text('')
        done = subprocess.run(
            ['bash', '-c', f'root={self.root}; . {SCRIPT}; make_environment run; echo "$venv"'],
            env={'PATH': f'{self.bin}:/usr/bin:/bin', 'HOME': str(self.root), **variables},
            capture_output=True, text=True, timeout=60, check=False)
        assert done.returncode == 0, done.stderr
        assert done.stdout.strip() == str(self.venv)
        return self.log.read_text().splitlines(), done.stderr

    @property
    def venv(self) -> Path:
        return self.root / '.venv'


@pytest.fixture
def set_up(tmp_path: Path) -> SetUp:
    if os.name != 'posix' or shutil.which('bash') is None:
        pytest.skip('the set-up is a bash script')
    assert not any((Path(place) / 'uv').exists() for place in ('/usr/bin', '/bin'))
    return SetUp(tmp_path)


def test_uv_makes_the_environment_and_installs_where_it_is_first_in_path(set_up: SetUp) -> None:
    set_up.put_uv()
    calls, _ = set_up.run()
    assert calls == [
        f'uv venv --quiet --seed --allow-existing --python {set_up.bin}/python3 {set_up.venv}',
        f'uv pip install --quiet --python {set_up.venv}/bin/python --editable {set_up.root}[run]']


def test_what_is_up_to_date_is_not_installed_again_until_a_dependency_changes(set_up: SetUp
                                                                              ) -> None:
    set_up.put_uv()
    set_up.run()
    assert set_up.run()[0] == []
    (set_up.root / 'setup.py').write_text('one more\n')
    calls, said = set_up.run()
    assert [call.split()[:2] for call in calls] == [['uv', 'pip']]
    assert said == f'updating {set_up.venv}\n'


def test_without_uv_pip_does_it(set_up: SetUp) -> None:
    calls, _ = set_up.run()
    assert calls[0] == f'python -m venv {set_up.venv}'
    assert calls[1].startswith('python -m pip install ')
    assert calls[1].endswith(f'--editable {set_up.root}[run]')
    assert len(calls) == 2


def test_uv_can_be_switched_off(set_up: SetUp) -> None:
    set_up.put_uv()
    calls, _ = set_up.run(LG_HUSKY_UV='0')
    assert [call.split()[0] for call in calls] == ['python', 'python']


def test_where_uv_fails_pip_is_tried_and_the_log_named(set_up: SetUp) -> None:
    set_up.put_uv(code=2)
    calls, said = set_up.run()
    assert [' '.join(call.split()[:3]) for call in calls] == [
        'uv venv --quiet', 'uv pip install', 'python -m pip']
    assert f'uv could not install it (see {set_up.venv}/install.log.uv): trying pip' in said


@pytest.mark.parametrize('with_uv', [True, False])
def test_locked_versions_are_handed_to_either(set_up: SetUp, with_uv: bool) -> None:
    (set_up.root / 'requirements.lock').write_text('numpy==1.26.4\n')
    if with_uv:
        set_up.put_uv()
    calls, _ = set_up.run(LG_HUSKY_LOCKED='1')
    assert f'--constraint {set_up.root}/requirements.lock' in calls[-1]
    assert calls[-1].startswith('uv pip' if with_uv else 'python -m pip')
