# SPDX-License-Identifier: Apache-2.0
"""GigE Vision client of tests: reads and writes registers of a camera on the loopback interface, and so takes control of it."""
import socket
import struct

CONTROL_PRIVILEGE = 0xA00
CONTROL, NO_CONTROL = 2, 0


class GvcpClient:
    """Takes control of a GigE Vision camera, and gives it up."""

    def __init__(self, port, patience_s):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.connect(("127.0.0.1", port))
        self.socket.settimeout(patience_s)
        self.number = 0

    def write(self, address, value):
        """Status of the answer; 0: done."""
        self.number += 1
        self.socket.send(struct.pack(">BBHHHII", 0x42, 1, 0x82, 8, self.number, address, value))
        return struct.unpack(">H", self.socket.recv(64)[:2])[0]

    def read(self, address):
        """The word of a register."""
        self.number += 1
        self.socket.send(struct.pack(">BBHHHI", 0x42, 1, 0x80, 4, self.number, address))
        return struct.unpack(">I", self.socket.recv(64)[8:12])[0]

    def address(self):
        """HOST:PORT as the camera names it."""
        return "{}:{}".format(*self.socket.getsockname())
