# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Quality of service with rclpy's names, translated as rmw_cyclonedds does."""

from __future__ import annotations

from dataclasses import dataclass
import enum

from cyclonedds.core import Policy, Qos

#: Longest that a write may wait for a stalled reader [ns]; a longer wait would stop the node.
MAX_BLOCKING = 100_000_000


class ReliabilityPolicy(enum.IntEnum):
    """Whether lost samples are sent again."""

    RELIABLE = 1
    BEST_EFFORT = 2


class DurabilityPolicy(enum.IntEnum):
    """Whether late joiners get what was sent before."""

    TRANSIENT_LOCAL = 1
    VOLATILE = 2


class HistoryPolicy(enum.IntEnum):
    """How many samples are kept; everything is KEEP_LAST here."""

    KEEP_LAST = 1


@dataclass(frozen=True)
class QoSProfile:
    """
    Quality of service of a publisher or a subscription.

    Parameters
    ----------
    depth : int
        Samples kept.
    reliability : ReliabilityPolicy
    durability : DurabilityPolicy
    history : HistoryPolicy
    lifespan_ns : int
        How long a sample is of use [ns]; 0 for ever.

    """

    depth: int = 10
    reliability: ReliabilityPolicy = ReliabilityPolicy.RELIABLE
    durability: DurabilityPolicy = DurabilityPolicy.VOLATILE
    history: HistoryPolicy = HistoryPolicy.KEEP_LAST
    lifespan_ns: int = 0

    def __post_init__(self) -> None:
        """Check the depth."""
        if self.depth < 1:
            raise ValueError(f'depth = {self.depth} is not at least 1')


qos_profile_sensor_data = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
qos_profile_services_default = QoSProfile(depth=10)
qos_profile_parameter_events = QoSProfile(depth=1000)
qos_profile_rosout = QoSProfile(
    depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL, lifespan_ns=10_000_000_000)


def as_profile(qos: QoSProfile | int) -> QoSProfile:
    """Return a profile; a number is the depth of a reliable one."""
    return QoSProfile(depth=qos) if isinstance(qos, int) else qos


def dds_qos(profile: QoSProfile, user_data: str, *, writer: bool) -> Qos:
    """
    Translate a profile.

    Parameters
    ----------
    profile : QoSProfile
        As asked for.
    user_data : str
        Sent along in discovery; holds the type hash.
    writer : bool
        Whether the endpoint writes.

    """
    policies = [
        Policy.History.KeepLast(profile.depth),
        Policy.DataRepresentation(use_cdrv0_representation=True),
        Policy.Userdata(user_data.encode()),
    ]
    if profile.reliability is ReliabilityPolicy.RELIABLE:
        policies.append(Policy.Reliability.Reliable(MAX_BLOCKING))
    else:
        policies.append(Policy.Reliability.BestEffort)
    if profile.durability is DurabilityPolicy.TRANSIENT_LOCAL:
        policies += [Policy.Durability.TransientLocal, Policy.DurabilityService(
            0, Policy.History.KeepLast(profile.depth), -1, -1, -1)]
    else:
        policies.append(Policy.Durability.Volatile)
    if writer:
        policies.append(Policy.WriterDataLifecycle(autodispose=False))
        if profile.lifespan_ns:
            policies.append(Policy.Lifespan(profile.lifespan_ns))
    return Qos(*policies)
