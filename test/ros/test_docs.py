# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Documentation, URDF, layouts and launch file agree with the code and with each other."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.ros.reference import filled, parameters_table, PRESETS, topics_table
from lg_husky_sim.ros.settings import make_settings, TABLE
import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]


def test_the_tables_of_the_documentation_are_up_to_date() -> None:
    """docs/ros.md holds what the code says; run lg_husky_sim.ros.reference after a change."""
    text = (ROOT / 'docs' / 'ros.md').read_text(encoding='utf-8')
    assert filled(text) == text
    assert all(f'| `{setting.name}` |' in text for setting in TABLE)
    assert text.count('<!-- end') == 3


def test_tables_name_every_topic_and_range() -> None:
    """Every topic setting of every preset is listed, every parameter has an allowed range."""
    table = topics_table()
    for preset in PRESETS:
        settings = make_settings(preset=preset)
        for setting in TABLE:
            if setting.name.endswith('_topic'):
                assert f'`{getattr(settings, setting.name)}`' in table
    assert all(len(row.split(' | ')) == 7 for row in parameters_table().splitlines())


def test_the_urdf_has_the_models_measures_and_joint_names() -> None:
    """Wheels stand where the model's track and wheelbase put them and touch the ground."""
    root = ElementTree.parse(ROOT / 'urdf' / 'husky.urdf').getroot()
    values = load_model().parameters
    wheels = [joint for joint in root.iter('joint') if joint.get('type') == 'continuous']
    assert tuple(joint.get('name') for joint in wheels) == make_settings().joint_names
    for joint in wheels:
        origin, axis = joint.find('origin'), joint.find('axis')
        assert origin is not None
        assert axis is not None
        x, y, z = (float(v) for v in str(origin.get('xyz')).split())
        assert abs(x) == pytest.approx(values['wheelbase'] / 2.0)
        assert abs(y) == pytest.approx(values['track'] / 2.0)
        assert z == pytest.approx(values['wheel_radius'])
        assert (y > 0.0) == ('left' in str(joint.get('name')))
        assert axis.get('xyz') == '0 1 0'
    links = {link.get('name') for link in root.iter('link')}
    for joint in root.iter('joint'):
        child, parent = joint.find('child'), joint.find('parent')
        assert child is not None
        assert parent is not None
        assert {child.get('link'), parent.get('link')} <= links


def test_layouts_show_topics_that_exist() -> None:
    """The files for RViz and Foxglove parse, and name topics of the default preset."""
    settings = make_settings()
    relative = {settings.command_topic, settings.odometry_topic, settings.ground_truth_topic,
                settings.imu_topic, settings.joint_states_topic, 'robot_description',
                settings.initial_pose_topic}
    rviz = yaml.safe_load((ROOT / 'config' / 'husky.rviz').read_text(encoding='utf-8'))
    displays = rviz['Visualization Manager']['Displays']
    assert rviz['Visualization Manager']['Global Options']['Fixed Frame'] == settings.odom_frame
    shown = {d['Topic']['Value'] for d in displays if 'Topic' in d}
    assert shown
    assert shown <= relative
    text = (ROOT / 'config' / 'husky.foxglove.json').read_text(encoding='utf-8')
    panels = json.loads(text)['configById']
    paths = [path['value'] for panel in panels.values() for path in panel.get('paths', ())]
    assert len(paths) == 8
    assert all(path.split('.')[0] in {f'/{topic}' for topic in relative} for path in paths)


def test_the_layout_of_the_twin_shows_what_it_publishes() -> None:
    """Row 22: measured, model and plain model beside each other, and the running errors."""
    text = (ROOT / 'config' / 'twin.foxglove.json').read_text(encoding='utf-8')
    source = (ROOT / 'lg_husky_sim' / 'ros' / 'twin.py').read_text(encoding='utf-8')
    paths = {path['value'] for panel in json.loads(text)['configById'].values()
             for path in panel['paths']}
    assert {path.split('.')[0] for path in paths} == {
        '/twin/measured', '/twin/model/reading', '/twin/plain/reading',
        *(f'/twin/{name}/{quantity}_error' for name in ('model', 'plain')
          for quantity in ('wheel_rate', 'yaw_rate'))}
    for topic in ("'twin/measured'", "f'twin/{name}/reading'", "f'twin/{name}/{quantity}_error'"):
        assert topic in source
