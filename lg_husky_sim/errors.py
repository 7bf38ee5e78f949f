# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Errors that a caller can do something about; each message is one line."""

from __future__ import annotations

#: Between the lines of a message that lists several errors; any other message is one line.
SEVERAL = '\n  '


class LgHuskyError(Exception):
    """Base of every error raised on purpose by this package."""


class GraphError(LgHuskyError):
    """A linear graph that cannot be built or derived."""


class ParameterError(LgHuskyError):
    """A physical parameter that is missing, unknown or out of its bounds."""


class UnknownParameterError(ParameterError, KeyError):
    """A parameter of no such name; a KeyError too, as of any mapping."""

    __str__ = Exception.__str__

    def __init__(self, message: str, name: str = '') -> None:
        """Keep the name."""
        super().__init__(message)
        self.name = name


class ModelFileError(LgHuskyError):
    """A model file that cannot be read."""


class RecordingError(LgHuskyError):
    """A recording that cannot be read, written or used."""


class CommandError(LgHuskyError):
    """A command script or a command-line argument that cannot be used."""


class FitError(LgHuskyError):
    """An estimation that cannot be started."""


class DiagnosisError(LgHuskyError):
    """A diagnosis that cannot be made."""


class SettingsError(LgHuskyError):
    """A setting of the node that is unknown or out of its range."""


class MissingExtraError(LgHuskyError):
    """An optional dependency that is needed here and not installed."""


class BackendError(LgHuskyError):
    """Workers for parallel tasks that cannot be reached, or were lost."""
