# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What recordings say for and against a hypothesis: one likelihood for all."""
