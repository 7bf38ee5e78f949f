# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
A Husky for the tests of a robot team.

Put ``pytest_plugins = ['lg_husky_sim.testing.fixtures']`` into ``conftest.py`` and take the
fixtures ``husky`` (in the test's process, in lock step, no ROS, no sleeping) or
``live_husky`` (a real node in its own process and domain).
"""
