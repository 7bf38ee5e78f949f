# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Domain and discovery range from the environment, as rmw_cyclonedds reads them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import os
from xml.sax.saxutils import quoteattr

from lg_husky_sim.errors import SettingsError

RANGES = ('SUBNET', 'LOCALHOST', 'OFF', 'SYSTEM_DEFAULT')
#: Highest domain whose ports exist.
MAX_DOMAIN = 232


@dataclass(frozen=True)
class Discovery:
    """
    Where peers are looked for.

    Parameters
    ----------
    domain : int
        DDS domain.
    range : str
        One of :data:`RANGES`.
    peers : tuple of str
        Addresses asked besides.

    """

    domain: int
    range: str  # noqa: A003
    peers: tuple[str, ...] = ()

    def xml(self, extra: str = '', pid: int | None = None) -> str:
        """
        Return the configuration of the DDS library.

        Parameters
        ----------
        extra : str
            What CYCLONEDDS_URI holds; it wins.
        pid : int, optional
            Process id that makes the tag of range OFF unique.

        """
        if self.range == 'SYSTEM_DEFAULT':
            return extra
        general = ''
        if self.range != 'SUBNET':
            listened = self._interfaces() if self.range == 'LOCALHOST' and not extra else ''
            general = f'<General>{listened}<AllowMulticast>false</AllowMulticast></General>'
        if self.range == 'OFF':
            tag = os.getpid() if pid is None else pid
            inner = ('<ParticipantIndex>none</ParticipantIndex>'
                     f'<Tag>ros_discovery_off_{tag}</Tag>')
        else:
            peers = (('localhost',) if self.range == 'LOCALHOST' else ()) + self.peers
            listed = ''.join(f'<Peer address={quoteattr(peer)}/>' for peer in peers)
            inner = ('<ParticipantIndex>auto</ParticipantIndex>'
                     '<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>'
                     + (f'<Peers>{listed}</Peers>' if listed else ''))
        text = (f'<CycloneDDS><Domain>{general}<Discovery>{inner}</Discovery></Domain>'
                '</CycloneDDS>')
        return f'{text},{extra}' if extra else text

    def _interfaces(self) -> str:
        # Cyclone from 11 on drops what arrives at an interface that it has not chosen, and
        # peers of older versions ask for localhost at the loopback interface only.
        away = '<NetworkInterface autodetermine="true"/>' if self.peers else ''
        return f'<Interfaces>{away}<NetworkInterface address="127.0.0.1"/></Interfaces>'


def read_discovery(environment: Mapping[str, str]) -> Discovery:
    """
    Read the discovery settings.

    Parameters
    ----------
    environment : mapping
        Such as ``os.environ``.

    Raises
    ------
    SettingsError
        If a variable holds what ROS 2 does not define.

    """
    text = environment.get('ROS_DOMAIN_ID', '').strip() or '0'
    if not (text.isascii() and text.isdigit() and int(text) <= MAX_DOMAIN):
        raise SettingsError(f'ROS_DOMAIN_ID = {text!r} is not a whole number from 0 to '
                            f'{MAX_DOMAIN}')
    peers = tuple(peer.strip() for peer in environment.get('ROS_STATIC_PEERS', '').split(';')
                  if peer.strip())
    span = environment.get('ROS_AUTOMATIC_DISCOVERY_RANGE', '').strip().upper() or 'SUBNET'
    if environment.get('ROS_LOCALHOST_ONLY', '').strip() == '1':
        # The older variable; rcl lets it win, and it allows no peers.
        return Discovery(int(text), 'LOCALHOST')
    if span not in RANGES:
        raise SettingsError(f'ROS_AUTOMATIC_DISCOVERY_RANGE = {span!r} is none of '
                            f'{", ".join(RANGES)}')
    return Discovery(int(text), span, peers)
