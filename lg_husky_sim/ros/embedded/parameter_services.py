# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The six parameter services of a node, which ``ros2 param`` calls."""

from __future__ import annotations

from typing import Any, TYPE_CHECKING

from lg_husky_sim.ros.embedded.messages import message_class
from lg_husky_sim.ros.embedded.parameters import Parameter, ParameterStore, ParameterType

if TYPE_CHECKING:
    from lg_husky_sim.ros.embedded.node import Node


def offer_parameter_services(node: Node, store: ParameterStore) -> None:
    """
    Offer get, get types, set, set atomically, list and describe.

    Parameters
    ----------
    node : Node
        Offers them below its name.
    store : ParameterStore
        The node's parameters.

    """
    empty = Parameter('', ParameterType.NOT_SET, None)

    def get(request: Any, response: Any) -> Any:
        response.values = [store.values.get(name, empty).get_parameter_value()
                           for name in request.names]
        return response

    def get_types(request: Any, response: Any) -> Any:
        response.types = [int(store.values.get(name, empty).type_) for name in request.names]
        return response

    def set_each(request: Any, response: Any) -> Any:
        response.results = [store.set_messages([one]) for one in request.parameters]
        return response

    def set_all(request: Any, response: Any) -> Any:
        response.result = store.set_messages(request.parameters)
        return response

    def listing(request: Any, response: Any) -> Any:
        names = sorted(
            name for name in store.values
            if (not request.prefixes or any(name == p or name.startswith(f'{p}.')
                                            for p in request.prefixes))
            and (not request.depth or name.count('.') < request.depth))
        response.result.names = names
        response.result.prefixes = sorted(
            {name.rpartition('.')[0] for name in names if '.' in name})
        return response

    def describe(request: Any, response: Any) -> Any:
        blank = message_class('rcl_interfaces/msg/ParameterDescriptor')
        response.descriptors = [store.descriptors.get(name) or blank(name=name)
                                for name in request.names]
        return response

    for kind, name, answer in (
            ('GetParameters', 'get_parameters', get),
            ('GetParameterTypes', 'get_parameter_types', get_types),
            ('SetParameters', 'set_parameters', set_each),
            ('SetParametersAtomically', 'set_parameters_atomically', set_all),
            ('ListParameters', 'list_parameters', listing),
            ('DescribeParameters', 'describe_parameters', describe)):
        node.create_service(f'rcl_interfaces/srv/{kind}', f'~/{name}', answer)
