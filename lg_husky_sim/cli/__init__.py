# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The command line: one verb a file, each telling its way hop by hop."""
