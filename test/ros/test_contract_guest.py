# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A robot in a user's own process, on rclpy's executors, beside nodes that are none of ours."""

from __future__ import annotations

import json
from pathlib import Path
import re
import subprocess
import sys

from lg_husky_sim.ros import api
from lg_husky_sim.testing.live import isolated_domain
import pytest

#: As docs/ros.md has it. The process is told things that are for its own node.
PROGRAM = """
import json, sys, threading, time
import rclpy
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.parameter import Parameter
from std_srvs.srv import SetBool
from lg_husky_sim.ros.simulation_node import SimNode

rclpy.init(args=['host', '--ros-args', '-p', 'threads:=4', '-p', 'gain:=2.5', '--log-level',
                 'host:=debug'])
husky = SimNode('husky', namespace='/a200_0000', parameter_overrides=[
    Parameter('preset', value='clearpath_jazzy'), Parameter('rate', value=20.0)])
mine = rclpy.create_node('mine')
gain = mine.declare_parameter('gain', 1.0).value
ticks = []
mine.create_timer(0.05, lambda: ticks.append(threading.get_ident()))
client = mine.create_client(SetBool, '/a200_0000/husky/pause')
executor = {'single': SingleThreadedExecutor, 'multi': MultiThreadedExecutor}[sys.argv[1]]()
executor.add_node(husky)
executor.add_node(mine)
thread = threading.Thread(target=executor.spin, daemon=True)
thread.start()
deadline = time.monotonic() + 60.0
while (husky.engine.total < 40 or len(ticks) < 20) and time.monotonic() < deadline:
    time.sleep(0.02)
ran = husky.engine.total
found = client.wait_for_service(30.0)
answer = client.call(SetBool.Request(data=True))
stood = husky.engine.total
time.sleep(1.0)
print(json.dumps({'ran': ran, 'ticks': len(ticks), 'gain': gain, 'found': found,
                  'answer': [answer.success, answer.message],
                  'stood': husky.engine.total - stood, 'preset': husky.settings.preset}))
executor.shutdown()
thread.join(10.0)
husky.destroy_node()
mine.destroy_node()
rclpy.try_shutdown()
"""


#: What the user of docs/ros.md brings along.
BROUGHT = """
from lg_husky_sim.ros import api
my_node = api.Node('mine')
api.steady_timer(my_node, 0.02, lambda: husky.engine.total > 5 and api.leave(my_node))
"""
PAGE = Path(__file__).resolve().parents[2] / 'docs' / 'ros.md'


@pytest.mark.parametrize('imports', ['rclpy', 'api'])
def test_the_page_of_the_node_says_how_it_lives_in_a_process(imports: str) -> None:
    """Its snippet imports rclpy, and nothing said what to import where that is not installed."""
    if imports == 'rclpy' and not api.HAVE_RCLPY:
        pytest.skip('rclpy is not installed')
    chapter = PAGE.read_text(encoding='utf-8').partition('## In your own process')[2]
    snippet = chapter.partition('```python\n')[2].partition('```')[0]
    if imports == 'api':
        lines = re.findall(r'`((?:import|from) [^`]*)`', chapter.partition('\n## ')[0])
        snippet = '\n'.join((*lines, *snippet.splitlines()[3:]))
        assert '\nfrom lg_husky_sim.ros.simulation_node' in snippet
        assert 'from rclpy' not in snippet
    before, made, rest = snippet.partition('executor = ')
    program, run, _ = (before + BROUGHT + made + rest).partition('executor.spin()')
    with isolated_domain():
        done = subprocess.run(
            [sys.executable, '-c', f'{program}try:\n    {run}\n'
             'except api.ExternalShutdownException:\n    pass\n'
             'print(husky.settings.preset, husky.engine.total > 5)\n'
             'husky.destroy_node()\nmy_node.destroy_node()\napi.try_shutdown()\n'],
            text=True, capture_output=True, timeout=120.0, check=False)
    assert done.stdout == 'clearpath_jazzy True\n', done.stderr


@pytest.mark.skipif(not api.HAVE_RCLPY, reason='rclpy is not installed: its executors are not '
                    'tested')
@pytest.mark.parametrize('executor', ['single', 'multi'])
def test_a_guest_lives_beside_other_nodes_on_either_executor(executor: str) -> None:
    """Both nodes run, one calls the other's service, and the process's parameters harm neither."""
    with isolated_domain():
        done = subprocess.run([sys.executable, '-c', PROGRAM, executor], text=True, check=False,
                              capture_output=True, timeout=200.0)
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout.splitlines()[-1])
    assert said['ran'] >= 40
    assert said['ticks'] >= 20
    assert said['gain'] == 2.5
    assert said['found']
    assert said['answer'] == [True, 'paused']
    assert said['stood'] == 0
    assert said['preset'] == 'clearpath_jazzy'
    assert 'Traceback' not in done.stderr
