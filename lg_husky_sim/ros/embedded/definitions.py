# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Definitions of the service types, and the type store that holds every message of Jazzy."""

from __future__ import annotations

from functools import cache, lru_cache
from typing import TYPE_CHECKING

from lg_husky_sim.errors import MissingExtraError

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

#: Request and response of each service type that the subset can offer.
SERVICES: dict[str, tuple[str, str]] = {
    'std_srvs/srv/Empty': ('', ''),
    'std_srvs/srv/Trigger': ('', 'bool success\nstring message'),
    'std_srvs/srv/SetBool': ('bool data', 'bool success\nstring message'),
    'rcl_interfaces/srv/GetParameters': (
        'string[] names', 'rcl_interfaces/ParameterValue[] values'),
    'rcl_interfaces/srv/GetParameterTypes': ('string[] names', 'uint8[] types'),
    'rcl_interfaces/srv/SetParameters': (
        'rcl_interfaces/Parameter[] parameters',
        'rcl_interfaces/SetParametersResult[] results'),
    'rcl_interfaces/srv/SetParametersAtomically': (
        'rcl_interfaces/Parameter[] parameters', 'rcl_interfaces/SetParametersResult result'),
    'rcl_interfaces/srv/ListParameters': (
        'string[] prefixes\nuint64 depth', 'rcl_interfaces/ListParametersResult result'),
    'rcl_interfaces/srv/DescribeParameters': (
        'string[] names', 'rcl_interfaces/ParameterDescriptor[] descriptors'),
}


@lru_cache(maxsize=1)
def store() -> Typestore:
    """
    Return the type store of ROS 2 Jazzy.

    Raises
    ------
    MissingExtraError
        If rosbags is not installed.

    """
    try:
        from rosbags.interfaces import Nodetype
        from rosbags.typesys import get_typestore, Stores
    except ModuleNotFoundError as error:
        raise MissingExtraError(
            'ROS messages without ROS need rosbags: pip install cyclonedds rosbags'
        ) from error
    types = get_typestore(Stores.ROS2_JAZZY)
    # rosidl reads the message language's char as uint8; the store hashes it as a char of IDL.
    types.fielddefs['rmw_dds_common/msg/Gid'] = (
        [], [('data', (Nodetype.ARRAY, ((Nodetype.BASE, ('uint8', 0)), 16)))])
    return types


@cache
def type_hash(name: str) -> str:
    """
    Return the RIHS01 hash (REP-2011) of a message type.

    Parameters
    ----------
    name : str
        Such as ``nav_msgs/msg/Odometry``.

    """
    return str(store().hash_rihs01(name))


@cache
def register_service(name: str) -> None:
    """
    Add a service's request and response to the store.

    Parameters
    ----------
    name : str
        A key of :data:`SERVICES`.

    """
    from rosbags.typesys import get_types_from_msg
    for suffix, text in zip(('Request', 'Response'), SERVICES[name], strict=True):
        text = text or 'uint8 structure_needs_at_least_one_member'
        (definition,) = get_types_from_msg(text, f'{name}_{suffix}').values()
        store().register({f'{name}_{suffix}': definition})
