# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What changed between two sets of recordings of a robot that plain LG need not fit."""
