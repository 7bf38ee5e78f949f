# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Command lines, names and the environment, as rcl reads them."""

from __future__ import annotations

from pathlib import Path

from lg_husky_sim.errors import SettingsError
from lg_husky_sim.ros.embedded.arguments import NodeNames, parse
from lg_husky_sim.ros.embedded.environment import Discovery, read_discovery
import pytest


def test_only_the_ros_section_is_read() -> None:
    """What stands before --ros-args and after -- is the program's own."""
    found = parse(['prog', '-p', 'x', '--ros-args', '-p', 'a:=1', '--', '-r', 'y'])
    assert found.rest == ('prog', '-p', 'x', '-r', 'y')
    assert [(r.name, r.value) for r in found.parameters] == [('a', 1)]


def test_values_are_yaml() -> None:
    """Types come from YAML, exponents without a dot included."""
    found = parse(['--ros-args', '-p', 'a:=true', '-p', 'b:=1e-3', '-p', 'c:=[1, 2]', '-p',
                   'd:=text', '-p', "e:='7'"])
    assert [r.value for r in found.parameters] == [True, 1e-3, [1, 2], 'text', '7']


@pytest.mark.parametrize(('words', 'message'), [
    (['--remapp', 'a:=b'], "unknown ROS argument '--remapp'"),
    (['-p'], '-p needs a value after it'),
    (['-p', 'a=1'], "-p 'a=1' is not of the form name:=value"),
    (['-p', 'a:=[1'], 'not YAML'),
    (['--params-file', '/no/file.yaml'], 'parameter file /no/file.yaml'),
])
def test_mistakes_are_named(words: list[str], message: str) -> None:
    """Each mistake is one line with the word in it."""
    with pytest.raises(SettingsError, match=message.replace('[', r'\[')):
        parse(['--ros-args', *words])


def test_names_are_expanded_and_remapped() -> None:
    """Absolute, relative and private names; rules for all nodes and for one."""
    arguments = parse(['--ros-args', '-r', '__ns:=/robot', '-r', '__node:=twin', '-r',
                       'odom:=/world/odom', '-r', 'twin:~/pause:=stop', '-r', 'other:imu:=x'])
    names = NodeNames.resolve('sim_node', '', arguments)
    assert names.full == '/robot/twin'
    assert names.expand('odom') == '/world/odom'
    assert names.expand('/odom') == '/odom'
    assert names.expand('~/pause') == '/robot/stop'
    assert names.expand('imu') == '/robot/imu'
    assert names.expand('~/x/y') == '/robot/twin/x/y'
    with pytest.raises(SettingsError, match="'/robot/a b' is not valid"):
        names.expand('a b')
    with pytest.raises(SettingsError, match=r"^name '1x': each part may hold letters"):
        NodeNames.resolve('1x', '', parse([]))
    with pytest.raises(SettingsError, match=r"^namespace '/a//b': .* neither be empty"):
        NodeNames.resolve('x', '/a//b', parse([]))


@pytest.mark.parametrize(('section', 'applies'), [
    ('/**', True), ('sim_node', True), ('/sim_node', False), ('/a/sim_node', True),
    ('/*/sim_node', True), ('/b/sim_node', False)])
def test_sections_of_a_parameter_file(tmp_path: Path, section: str, applies: bool) -> None:
    """Wildcards and full names choose the nodes that a section is for."""
    path = tmp_path / 'p.yaml'
    path.write_text(f'{section}:\n  ros__parameters:\n    rate: 10.0\n    group: {{x: 1}}\n',
                    encoding='utf-8')
    names = NodeNames.resolve('sim_node', '/a', parse(
        ['--ros-args', '--params-file', str(path)]))
    assert names.parameters() == ({'rate': 10.0, 'group.x': 1} if applies else {})


def test_later_parameters_win(tmp_path: Path) -> None:
    """As in rcl, the last word counts, of files and command line alike."""
    path = tmp_path / 'p.yaml'
    path.write_text('/**: {ros__parameters: {rate: 10.0}}', encoding='utf-8')
    file, word = ['--params-file', str(path)], ['-p', 'rate:=20.0']
    for order, rate in ((file + word, 20.0), (word + file, 10.0)):
        names = NodeNames.resolve('n', '', parse(['--ros-args', *order]))
        assert names.parameters()['rate'] == rate


def test_a_file_without_ros_parameters_is_refused(tmp_path: Path) -> None:
    """The usual slip, a level missing, is named."""
    path = tmp_path / 'p.yaml'
    path.write_text('sim_node: {rate: 10.0}', encoding='utf-8')
    with pytest.raises(SettingsError, match='sim_node/rate has no ros__parameters'):
        parse(['--ros-args', '--params-file', str(path)])


@pytest.mark.parametrize(('environment', 'expected'), [
    ({}, Discovery(0, 'SUBNET')),
    ({'ROS_DOMAIN_ID': '42', 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'off'}, Discovery(42, 'OFF')),
    ({'ROS_STATIC_PEERS': '10.0.0.1;host'}, Discovery(0, 'SUBNET', ('10.0.0.1', 'host'))),
    ({'ROS_LOCALHOST_ONLY': '1', 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET',
      'ROS_STATIC_PEERS': 'a'}, Discovery(0, 'LOCALHOST')),
])
def test_environment(environment: dict[str, str], expected: Discovery) -> None:
    """Variables are read as ROS 2 reads them."""
    assert read_discovery(environment) == expected


@pytest.mark.parametrize(('environment', 'message'), [
    ({'ROS_DOMAIN_ID': '233'}, "ROS_DOMAIN_ID = '233' is not a whole number from 0 to 232"),
    ({'ROS_DOMAIN_ID': '-1'}, "ROS_DOMAIN_ID = '-1'"),
    ({'ROS_AUTOMATIC_DISCOVERY_RANGE': 'HERE'}, "'HERE' is none of SUBNET, LOCALHOST, OFF"),
])
def test_a_wrong_environment_is_refused(environment: dict[str, str], message: str) -> None:
    """A typing error must not end up in domain 0 of the whole subnet."""
    with pytest.raises(SettingsError, match=message):
        read_discovery(environment)


def test_discovery_ranges_become_the_configuration_of_cyclone() -> None:
    """As rmw_cyclonedds writes it: multicast off, peers, 32 participants, a tag for OFF."""
    local = Discovery(1, 'LOCALHOST').xml()
    assert '<AllowMulticast>false</AllowMulticast>' in local
    assert '<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>' in local
    assert '<Peers><Peer address="localhost"/></Peers>' in local
    assert '127.0.0.1' in local
    subnet = Discovery(1, 'SUBNET', ('10.0.0.1',)).xml()
    assert 'AllowMulticast' not in subnet
    assert '<Peer address="10.0.0.1"/>' in subnet
    assert '<Tag>ros_discovery_off_77</Tag>' in Discovery(1, 'OFF').xml(pid=77)
    assert Discovery(1, 'SYSTEM_DEFAULT').xml('file:///x.xml') == 'file:///x.xml'
    assert Discovery(1, 'LOCALHOST').xml('file:///x.xml').endswith(',file:///x.xml')
