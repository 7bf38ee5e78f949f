# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The twin beside a robot: its running errors tell the better model."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
import signal
import subprocess
import sys
from typing import Any

from lg_husky_sim.cli.twin import _sides
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model, ModelFile, save_model
from lg_husky_sim.identification.options import with_effects
from lg_husky_sim.recording import Recording, write_recording
from lg_husky_sim.ros.settings import make_settings
from lg_husky_sim.signals import BodyTwist
from lg_husky_sim.simulation import Simulator, SimulatorState
import pytest

for needed in ('rosbags', 'cyclonedds'):
    pytest.importorskip(needed)

from lg_husky_sim.ros.tool import Orderly, Tool  # noqa: E402, I100
from lg_husky_sim.ros.twin import NAME, RunningError, Shadow, Twin  # noqa: E402
from lg_husky_sim.testing.live import probed_domain  # noqa: E402


def turning_robot() -> tuple[Shadow, Shadow]:
    """Return a robot that begins to turn at 0 s, and a model of it that has heard nothing."""
    model = load_model()
    plant = compile_model(model.structure).at(model.parameters)
    robot = Shadow(plant)
    robot.wheels(0.0, 0.0, 0.0)
    robot.command(0.0, BodyTwist(0.5, 0.3))
    return robot, Shadow(plant)


def test_running_error_forgets_and_the_overall_one_does_not() -> None:
    error = RunningError(memory=1.0)
    error.add(0.0, 3.0)
    for moment in range(1, 101):
        error.add(20.0 + 0.01 * moment, 1.0)
    assert error.now == pytest.approx(1.0, abs=1e-6)
    assert error.overall == pytest.approx(((9.0 + 100.0) / 101.0) ** 0.5)


def test_shadow_of_the_robot_itself_has_no_error() -> None:
    robot, shadow = turning_robot()
    shadow.wheels(0.0, 0.0, 0.0)
    shadow.command(0.0, BodyTwist(0.5, 0.3))
    for step in range(1, 200):
        moment = 0.01 * step + 1e-6
        robot._advance(moment)
        assert robot._state is not None
        shadow.wheels(moment, *robot._state.wheel_rates)
        shadow.gyro(moment, robot._state.twist.yaw)
    assert shadow.errors['wheel_rate'].count == 398
    assert shadow.errors['wheel_rate'].overall < 1e-9
    assert shadow.errors['yaw_rate'].overall < 1e-9


def test_joining_a_robot_in_motion_and_after_a_pause() -> None:
    """It rolls already; and after a pause the models begin anew, whatever is heard first."""
    robot, shadow = turning_robot()
    for step in range(1, 900):
        moment = 0.01 * step + 1e-6
        robot._advance(moment)
        assert robot._state is not None
        if step == 300:
            shadow.command(moment, BodyTwist(0.5, 0.3))
        if 300 <= step < 400 or step >= 800:
            shadow.gyro(moment, robot._state.twist.yaw)
            shadow.wheels(moment, *robot._state.wheel_rates)
    assert shadow.errors['wheel_rate'].count == 2 * (99 + 99)
    assert shadow.errors['wheel_rate'].overall < 0.02
    assert shadow.errors['yaw_rate'].overall < 0.01


def test_stale_command_is_forgotten_as_the_base_does() -> None:
    model = load_model()
    shadow = Shadow(compile_model(model.structure).at(model.parameters),
                    make_settings(command_timeout=0.25))
    shadow.wheels(0.0, 0.0, 0.0)
    shadow.command(0.0, BodyTwist(0.5, 0.0))
    shadow.gyro(0.2, 0.0)
    assert shadow._state is not None
    assert shadow._state.wheel_rates[0] > 1.0
    shadow.gyro(0.9, 0.0)
    assert abs(shadow._state.wheel_rates[0]) < 0.1


@pytest.mark.parametrize(('timeout', 'age', 'rate', 'followed'), [
    (0.5, 14.0, 0.0, False),  # at rest: whatever was said long ago
    (0.0, 14.0, 0.0, False),
    (0.5, 14.0, 6.0, False),  # pushed, or braking: the base has forgotten
    (0.5, 0.2, 6.0, True),
    (0.0, 14.0, 6.0, True),
])
def test_a_model_that_begins_anew_follows_what_the_base_still_does(
        timeout: float, age: float, rate: float, followed: bool) -> None:
    model = with_effects(load_model(), ['command_latency'])
    shadow = Shadow(compile_model(model.structure).at(model.parameters.replacing(
        {'latency': 0.3})), settings=make_settings(command_timeout=timeout))
    shadow.command(0.0, BodyTwist(1.0, 0.0))
    shadow.wheels(age, rate, rate)
    shadow.wheels(age + 0.28, rate, rate)
    assert shadow._state is not None
    for simulated in shadow._state.wheel_rates:
        assert simulated == pytest.approx(6.0 if followed else 0.0, abs=0.7)


@pytest.mark.parametrize(('names', 'rates', 'wanted'), [
    (['front_left_wheel', 'front_right_wheel', 'rear_left_wheel', 'rear_right_wheel'],
     [1.0, 2.0, 3.0, 4.0], (2.0, 3.0)),
    (['right_wheel', 'left_wheel'], [1.0, 2.0], (2.0, 1.0)),
])
def test_wheels_are_found_by_name(names: list[str], rates: list[float],
                                  wanted: tuple[float, float]) -> None:
    assert _sides(names, rates) == wanted


@pytest.mark.realtime
def test_live_error_drops_with_the_augmented_model(
        drive: Callable[..., Recording], tmp_path: Path) -> None:
    write_recording(tmp_path / 'bag', drive('any', 'rotation', 4, share=0.5).streams,
                    frames=('odom', 'base_link'))
    model = load_model()
    (entry,) = (p for p in Effect('yaw_scrub_coulomb').parameters()
                if p.name == 'yaw_coulomb_moment')
    others = (p for p in Effect('yaw_scrub_coulomb').parameters()
              if p.name != 'yaw_coulomb_moment')
    robot = model.parameters.replacing({'wheel_damping': 1.3, 'yaw_damping': 14.0})
    augmented = ModelFile(
        model.structure.with_effect(Effect('yaw_scrub_coulomb')),
        robot.with_entries(entry.parameter(4.0), *(p.parameter() for p in others)), 'augmented')
    save_model(augmented, tmp_path / 'model.yaml')
    read = load_model(tmp_path / 'model.yaml')
    plants = {'plain': compile_model(model.structure).at(robot),
              'model': compile_model(read.structure).at(read.parameters)}
    settings = make_settings(preset='paper')
    with probed_domain() as probe:
        heard: dict[str, list[Any]] = {name: probe.listen(
            'std_msgs/msg/Float64', f'twin/{name}/yaw_rate_error') for name in plants}
        tool = Tool(NAME, Orderly())
        twin = Twin(tool, plants, settings, _sides)
        try:
            player = subprocess.Popen(
                [sys.executable, '-m', 'lg_husky_sim.cli.main', 'play', str(tmp_path / 'bag'),
                 '--wait', '30'], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            try:
                for _ in range(80):
                    twin.spin(0.4)
                    probe.spin(0.02)
                    if player.poll() is not None:
                        break
            finally:
                player.kill()
                player.wait()
            errors = {name: shadow.errors['yaw_rate'] for name, shadow in twin.shadows.items()}
            assert errors['plain'].count > 300
            assert errors['model'].overall < 0.7 * errors['plain'].overall
            assert heard['plain'][-1].data > heard['model'][-1].data > 0.0
        finally:
            tool.close()


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize('verb', ['play', 'drive'])
def test_a_signal_ends_what_is_sent_with_one_line(
        drive: Callable[..., Recording], tmp_path: Path, verb: str, number: signal.Signals
        ) -> None:
    write_recording(tmp_path / 'bag', drive('any', 'rotation', 4, share=0.5).streams,
                    frames=('odom', 'base_link'))
    what = str(tmp_path / 'bag') if verb == 'play' else 'circle'
    with probed_domain() as probe:
        heard = probe.listen('geometry_msgs/msg/Twist', make_settings().command_topic)
        sender = subprocess.Popen(
            [sys.executable, '-m', 'lg_husky_sim.cli.main', verb, what, '--wait', '30'],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        try:
            assert probe.until(lambda: heard or sender.poll() is not None, 30.0)
            sender.send_signal(number)
            _, said = sender.communicate(timeout=10.0)
        finally:
            sender.kill()
            sender.wait()
    assert sender.returncode == 130
    assert said.replace('\r', '\n').splitlines()[-1] == 'interrupted'
    assert 'Traceback' not in said


def test_a_shadow_has_stepped_before_it_hears_anything(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compiling takes seconds; a robot that drives meanwhile would be blamed on the model."""
    stepped: list[float] = []
    step = Simulator.step

    def counted(self: Simulator, state: SimulatorState, command: BodyTwist) -> SimulatorState:
        stepped.append(state.time)
        return step(self, state, command)
    monkeypatch.setattr(Simulator, 'step', counted)
    model = load_model()
    shadow = Shadow(compile_model(model.structure).at(model.parameters))
    assert len(stepped) == 1
    assert shadow._state is None


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_twin_with_its_errors(tmp_path: Path, number: signal.Signals) -> None:
    save_model(load_model(), tmp_path / 'model.yaml')
    with probed_domain():
        twin = subprocess.Popen(
            [sys.executable, '-u', '-m', 'lg_husky_sim.cli.main', 'twin', '--model',
             str(tmp_path / 'model.yaml'), '--every', '0.2', '--preset', 'paper'],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        assert twin.stdout is not None
        try:
            assert 'nothing received yet' in twin.stdout.readline()
            twin.send_signal(number)
            out, said = twin.communicate(timeout=10.0)
        finally:
            twin.kill()
            twin.wait()
    assert twin.returncode == 0
    assert 'overall' in out.splitlines()[-1]
    assert 'Traceback' not in said
