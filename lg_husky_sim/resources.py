# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Where the package's own data files are, in a wheel, a colcon install or a source tree."""

from __future__ import annotations

from pathlib import Path

from lg_husky_sim.errors import SettingsError

_PACKAGE = Path(__file__).resolve().parent


def data_folder(folder: str) -> Path:
    """
    Return a folder of data files that travels with the package.

    Parameters
    ----------
    folder : str
        ``config`` or ``urdf``.

    Returns
    -------
    Path
        Inside the package when installed from a wheel or by colcon, beside it in a source tree
        (editable and symlink installs included).

    Raises
    ------
    SettingsError
        The installation lacks the folder.

    """
    installed, source = _PACKAGE / folder, _PACKAGE.parent / folder
    if installed.is_dir():
        return installed
    if source.is_dir() and (_PACKAGE.parent / 'package.xml').is_file():
        return source
    message = f'data folder {folder} is missing from the installation: looked in {installed} ' \
              f'and {source}; install the package again'
    raise SettingsError(message)


def config_path(name: str) -> Path:
    """
    Return the path of a file of the package's ``config`` folder.

    Parameters
    ----------
    name : str
        File name, such as ``husky.yaml``.

    Returns
    -------
    Path
        An existing file.

    Raises
    ------
    SettingsError
        No such file; the message lists those there are.

    """
    folder = data_folder('config')
    path = folder / name
    if not path.is_file():
        present = ', '.join(sorted(entry.name for entry in folder.iterdir() if entry.is_file()))
        message = f'config file {name} does not exist; there are: {present}'
        raise SettingsError(message)
    return path
