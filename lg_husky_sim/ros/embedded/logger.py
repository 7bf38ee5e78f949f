# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Log lines in rclpy's form, on stderr and on /rosout."""

from __future__ import annotations

from collections.abc import Callable
import sys
import time

LEVELS = {'debug': 10, 'info': 20, 'warn': 30, 'error': 40, 'fatal': 50}


class RcutilsLogger:
    """
    Logger of a node.

    Parameters
    ----------
    name : str
        Stands in each line.
    level : str
        Least level that is said.
    publish : callable
        Receives level, name and text of each line, for /rosout.

    """

    def __init__(self, name: str, level: str, publish: Callable[[int, str, str, str], None]
                 ) -> None:
        """Keep the settings."""
        self.name = name
        self._level = LEVELS.get(level, 20)
        self._publish = publish
        self._last: dict[tuple[str, int], float] = {}

    def _log(self, word: str, message: str, throttle: float) -> bool:
        level = LEVELS[word]
        if level < self._level:
            return False
        frame = sys._getframe(2)
        place = frame.f_code.co_filename, frame.f_lineno
        now = time.monotonic()
        if throttle:
            if now - self._last.get(place, -1e9) < throttle:
                return False
            self._last[place] = now
        stamp = time.time()
        print(f'[{word.upper()}] [{stamp:.9f}] [{self.name}]: {message}', file=sys.stderr,
              flush=True)
        self._publish(level, message, place[0], frame.f_code.co_name)
        return True

    def debug(self, message: str, *, throttle_duration_sec: float = 0.0) -> bool:
        """Log for developers."""
        return self._log('debug', message, throttle_duration_sec)

    def info(self, message: str, *, throttle_duration_sec: float = 0.0) -> bool:
        """Log what a user may want to know."""
        return self._log('info', message, throttle_duration_sec)

    def warning(self, message: str, *, throttle_duration_sec: float = 0.0) -> bool:
        """Log what a user should know."""
        return self._log('warn', message, throttle_duration_sec)

    def error(self, message: str, *, throttle_duration_sec: float = 0.0) -> bool:
        """Log what went wrong."""
        return self._log('error', message, throttle_duration_sec)
