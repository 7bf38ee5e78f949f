# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The concealed trial: hidden robots, sealed answers and their scoring.

Nothing here shares code with the model or the diagnosis that it judges: the robots
are integrated from their own Newton-Euler equations (or by MuJoCo), and the only
thing that passes between the two sides is a rosbag and the published command line.
"""
