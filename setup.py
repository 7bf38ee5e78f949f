# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Installation with pip or colcon; the same package either way."""

from pathlib import Path

from setuptools import find_packages, setup

package_name = 'lg_husky_sim'
# colcon build --symlink-install runs a link to this file in another folder.
ROOT = Path(__file__).resolve().parent

# Folders beside the package that it reads at run time. They travel inside the wheel (and are found
# there by lg_husky_sim/resources.py) and, as ROS users expect, in share/ too.
DATA_FOLDERS = [folder for folder in ('config', 'urdf') if (ROOT / folder).is_dir()]
SHARE_FOLDERS = [*DATA_FOLDERS, *(folder for folder in ('launch',) if (ROOT / folder).is_dir())]

EXTRAS = {
    'fast': ['numba>=0.59', 'threadpoolctl>=3.1'],
    'plot': ['matplotlib>=3.6'],
    'bags': ['rosbags>=0.11'],
    # cyclonedds ships no wheel for Linux on ARM and none after Python 3.13.
    'dds': [
        'cyclonedds>=0.10.5,!=11.0.0; python_version < "3.14"'
        ' and (platform_machine == "x86_64" or platform_machine == "AMD64"'
        ' or sys_platform == "darwin")',
    ],
    'engine': ['mujoco>=3.1'],
    # Not part of `all`: where PyPI has no wheel, it is built by a C++ compiler.
    'bullet': ['pybullet>=3.2.5'],
    'scale': ['dask[distributed]>=2024.1'],
    # Not part of `all` either: large, and one cluster is enough.
    'ray': ['ray>=2.9'],
    'search': ['deap>=1.4'],
    'report': ['jinja2>=3.1', 'plotly>=6.0'],
    'tables': ['control>=0.10', 'pandas>=2.0'],
}
EXTRAS['run'] = [need for extra in ('fast', 'plot', 'bags', 'dds', 'report', 'search')
                 for need in EXTRAS[extra]]
# What the notebooks and `evaluate` need and no more: neither DDS nor an engine.
EXTRAS['notebook'] = [*(need for extra in ('fast', 'plot', 'bags', 'report', 'search', 'tables')
                        for need in EXTRAS[extra]), 'ipywidgets>=8', 'jupyterlab>=4']
EXTRAS['all'] = [*EXTRAS['run'], *EXTRAS['engine'], *EXTRAS['scale'], *EXTRAS['tables']]
EXTRAS['test'] = ['hypothesis>=6.100', 'ipykernel>=6', 'jsonschema>=4.18', 'nbclient>=0.10',
                  'nbformat>=5.9', 'pytest>=8', 'pytest-rerunfailures>=16.7',
                  'pytest-xdist>=3.5', 'setuptools>=70.1']
EXTRAS['docs'] = ['mkdocs-material~=9.8', 'mkdocstrings[python]>=0.27']
EXTRAS['dev'] = [
    *EXTRAS['test'],
    *EXTRAS['docs'],
    # Linters are held at one version each: a newer one may find what was fine yesterday.
    'flake8~=7.5.0',
    'flake8-builtins~=3.1.0',
    'flake8-comprehensions~=3.17.0',
    'flake8-docstrings~=1.7.0',
    'flake8-import-order~=0.19.0',
    'flake8-quotes~=3.4.0',
    'mypy~=2.4.0',
    'pydocstyle~=6.3.0',
    'ruff~=0.17.0',
    'types-PyYAML',
    'types-tqdm',
]
EXTRAS['check'] = [*EXTRAS['all'], *EXTRAS['dev']]


def files_of(folder):
    """Return one data_files row for each folder below (and with) the given one."""
    rows = {}
    for path in sorted((ROOT / folder).rglob('*')):
        if path.is_file() and '__pycache__' not in path.parts:
            path = path.relative_to(ROOT)
            rows.setdefault(f'share/{package_name}/{path.parent.as_posix()}', []).append(
                path.as_posix())
    return list(rows.items())


setup(
    name=package_name,
    version='0.1.0',
    description='Live digital twin of the Clearpath Husky, derived from a linear graph',
    long_description=(ROOT / 'README.md').read_text(encoding='utf-8'),
    long_description_content_type='text/markdown',
    author='lg_husky_sim contributors',
    maintainer='lg_husky_sim contributors',
    maintainer_email='maintainers@lg-husky-sim.example',
    license='Apache-2.0',
    python_requires='>=3.11',
    packages=[
        *sorted(find_packages(include=['lg_husky_sim', 'lg_husky_sim.*'])),
        *(f'{package_name}.{folder}' for folder in DATA_FOLDERS),
    ],
    package_dir={f'{package_name}.{folder}': folder for folder in DATA_FOLDERS},
    package_data={'': ['py.typed', '*.yaml', '*.urdf', '*.rviz', '*.xml', '*.json', '*.j2',
                       '*.html', '*.css', '*.js', '*.svg']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package_name}']),
        (f'share/{package_name}', ['package.xml']),
        *(row for folder in SHARE_FOLDERS for row in files_of(folder)),
    ],
    install_requires=[
        'click>=8.1',
        'joblib>=1.3',
        'numpy>=1.26',
        'pyyaml>=6.0',
        'rich>=13',
        'scipy>=1.11',
        'setuptools',
        'sympy>=1.12',
        'tqdm>=4.60',
    ],
    extras_require=EXTRAS,
    zip_safe=False,
    entry_points={
        'console_scripts': [
            'sim_node = lg_husky_sim.ros.sim_node:main',
            'lg_husky = lg_husky_sim.cli.main:main',
        ],
    },
)
