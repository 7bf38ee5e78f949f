# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The public Python API: what `import lg_husky_sim as lg` offers, and the command line uses."""
