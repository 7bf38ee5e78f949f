# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Live digital twin of the Clearpath Husky, derived from a linear graph."""
