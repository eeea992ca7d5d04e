# SPDX-License-Identifier: Apache-2.0
"""A reader of a daemon's frame ring, in Python: see "The frame ring" of docs/control.md.

    ring = RingReader("/run/obscura/obscurad-1.socket")
    ring.watch()                # frames are copied for the next 2 s
    serial, header, pixels = ring.newest()

By itself (ring_reader.py SOCKET) it reads until it is ended, and prints the serial numbers of the frames that it has read.
"""
import array
import json
import mmap
import os
import select
import socket
import struct
import sys

HEAD = struct.Struct("=8sIIQQQQ")  # magic, version, slots, slots_at, slot_bytes, pixels_at, most_pixels; then newest
HEADER = struct.Struct("=QQQqqqdIIIIIIii")
NAMES = "number frame trigger edge_tai_ns mid_exposure_tai_ns exposure_ns gain_db width height bits rows flags windows x y".split()


class RingReader:
    """Thread-bound. Raises OSError, and RuntimeError with the daemon's words."""

    def __init__(self, path, camera=0):
        self.camera = camera
        self.monitor = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.monitor.connect(path)
        _, descriptors = self._ask("ring")
        memory, self.news = descriptors
        self.memory = mmap.mmap(memory, 0, mmap.MAP_SHARED, mmap.PROT_READ)
        os.close(memory)
        magic, version, self.slots, self.slots_at, self.slot_bytes, self.pixels_at, _ = HEAD.unpack_from(self.memory)
        if (magic, version) != (b"OBSCRING", 1):
            raise RuntimeError(f"no frame ring: {magic} {version}")

    def _ask(self, verb, **fields):
        self.monitor.send(json.dumps({"verb": verb, "camera": self.camera, **fields}).encode())
        answer, descriptors, _, _ = socket.recv_fds(self.monitor, 65536, 2)
        told = json.loads(answer)
        if "error" in told:
            raise RuntimeError(told["error"])
        return told, descriptors

    def watch(self, period_us=0):
        self._ask("watch", period_us=period_us)

    def wait(self, patience_s):
        """Until a frame comes; false: none came."""
        return bool(select.select([self.news], [], [], patience_s)[0]) and bool(os.read(self.news, 8))

    def _number(self, at):
        return struct.unpack_from("=Q", self.memory, at)[0]

    def newest(self):
        """(serial number, header, pixels) of the newest frame; None: there is none, or it was overwritten meanwhile."""
        serial = self._number(HEAD.size)
        at = self.slots_at + serial % self.slots * self.slot_bytes
        if serial == 0 or self._number(at) != serial:
            return None
        header = dict(zip(NAMES, HEADER.unpack_from(self.memory, at + 8)))
        pixels = array.array("H", self.memory[at + self.pixels_at:at + self.pixels_at + 2 * header["width"] * header["height"]])
        return (serial, header, pixels) if self._number(at) == serial else None

    def close(self):
        self.memory.close()
        os.close(self.news)
        self.monitor.close()


def main(path):
    ring, last = RingReader(path), 0
    while True:
        ring.watch()
        ring.wait(1)
        found = ring.newest()
        if found and found[0] > last:
            last = found[0]
            print(last, flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
