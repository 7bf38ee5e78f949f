# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Reports: one page, one design and one set of words for all kinds of results."""
