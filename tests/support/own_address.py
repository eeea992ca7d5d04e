# SPDX-License-Identifier: Apache-2.0
"""An address at which programs of this machine can be reached as those of other machines reach them."""
import socket


def own_address():
    """IPv4 address of this machine in its network; 127.0.0.1 without a network."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # sends nothing
        except OSError:
            return "127.0.0.1"
        return probe.getsockname()[0]
