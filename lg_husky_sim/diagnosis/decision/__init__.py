# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""When a hypothesis is adopted, and how sure an answer is."""
