# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Recordings: ROS bags read into time series, and written from them.

Reads rosbag2 (MCAP, sqlite3) and ROS 1 bags without ROS, by way of the library `rosbags`.
"""

from lg_husky_sim.recording.driven import check_driven
from lg_husky_sim.recording.names import named_apart, named_as_in
from lg_husky_sim.recording.reader import read_recording
from lg_husky_sim.recording.recording import (
    driven_segments,
    Recording,
    Segment,
    segments,
    windows,
)
from lg_husky_sim.recording.topics import TopicMap
from lg_husky_sim.recording.writer import write_recording

__all__ = [
    'Recording',
    'Segment',
    'TopicMap',
    'check_driven',
    'driven_segments',
    'named_apart',
    'named_as_in',
    'read_recording',
    'segments',
    'windows',
    'write_recording',
]
