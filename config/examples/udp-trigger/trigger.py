#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Sends three triggers to a camera with [trigger] source = "udp", a fifth of a second apart."""
import socket
import struct
import time

with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
    for number in range(1, 4):  # a gap in the numbers would count as lost triggers, 0 does not count
        instant_ns = 0  # of TAI; 0: when the datagram arrives
        udp.sendto(struct.pack(">4sIQ", b"OBTR", number, instant_ns), ("127.0.0.1", 5002))
        time.sleep(0.2)
print("3 triggers sent")
