# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""One line brings the fixtures `husky` and `live_husky`."""

pytest_plugins = ['lg_husky_sim.testing.fixtures']
