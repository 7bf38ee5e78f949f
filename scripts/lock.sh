#!/usr/bin/env bash
# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
# Writes requirements.lock: the versions in the environment of ./check, names and numbers only.
#   LG_HUSKY_VENV=FOLDER scripts/lock.sh
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
venv=${LG_HUSKY_VENV:-$root/.venv}
"$venv/bin/python" "$root/scripts/lock.py" > "$root/requirements.lock.new"
mv "$root/requirements.lock.new" "$root/requirements.lock"
