# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Which hypotheses are tried, and which one the evidence prefers."""
