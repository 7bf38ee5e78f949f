# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The paper's evaluation, redone: manoeuvres, an engine, baselines, tables and figures."""
