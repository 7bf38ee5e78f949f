# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What the sensors of any robot say of each other, without a model of it."""
