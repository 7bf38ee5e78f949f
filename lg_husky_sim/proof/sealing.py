# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Sealed answers: a salted commitment is published before anybody diagnoses."""

from __future__ import annotations

from collections.abc import Mapping
import hashlib
import json
import math
import os
from pathlib import Path
from typing import Any

from lg_husky_sim.errors import LgHuskyError


def commitment(answer: Mapping[str, Any]) -> str:
    """Return the SHA-256 of an answer (which holds its salt), in hexadecimal."""
    text = json.dumps(answer, sort_keys=True, separators=(',', ':'))
    return hashlib.sha256(text.encode()).hexdigest()


def write_json(path: Path, value: Any) -> None:
    """Write `value` as JSON, complete or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(path.name + '.part')
    draft.write_text(json.dumps(value, indent=1, sort_keys=True) + '\n', encoding='utf-8')
    os.replace(draft, path)


def seal(path: Path, answer: Mapping[str, Any]) -> str:
    """Write an answer and return its commitment."""
    write_json(path, dict(answer))
    return commitment(answer)


def unseal(path: Path, expected: str) -> dict[str, Any]:
    """
    Return an answer that is the one committed to.

    Raises
    ------
    LgHuskyError
        The answer was changed after the commitment.

    """
    answer: dict[str, Any] = json.loads(path.read_text(encoding='utf-8'))
    found = commitment(answer)
    if found != expected:
        raise LgHuskyError(f'answer {path.name} has commitment {found[:12]}, '
                           f'published was {expected[:12]}')
    return answer


def plain(value: Any) -> Any:
    """Return JSON's own types, with infinities as text."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value
