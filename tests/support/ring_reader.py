# SPDX-License-Identifier: Apache-2.0
"""A reader of a daemon's frame ring, in Python: see "The frame ring" of docs/control.md.

    ring = RingReader("/run/obscura/obscurad-1.socket")       # monitor.socket or control.unix_socket
    ring.watch()                # frames are copied for the next 2 s
    serial, header, pixels = ring.newest()

By itself (ring_reader.py SOCKET) it reads until it is ended, and prints the serial numbers of the frames that it has read.
"""
import array
import mmap
import os
import pathlib
import select
import struct
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "clients" / "python"))
try:
    import obscura_client  # noqa: E402
except ImportError:
    print("skipped: Python's numpy is not installed (Debian package python3-numpy)")
    sys.exit(77)

HEAD = struct.Struct("=8sIIQQQQ")  # magic, version, slots, slots_at, slot_bytes, pixels_at, most_pixels; then newest
HEADER = struct.Struct("=QQQqqqdIIIIIIii")
NAMES = "number frame trigger edge_tai_ns mid_exposure_tai_ns exposure_ns gain_db width height bits rows flags windows x y".split()


class RingReader:
    """Thread-bound. Raises what obscura_client raises, and RuntimeError for memory that is no ring."""

    def __init__(self, path, camera=0):
        self.daemon = obscura_client.connect_camera(str(path), camera=camera)
        self.camera = camera
        self.daemon.call("ring", camera=camera)
        memory, self.news = self.daemon.take_descriptors()
        self.memory = mmap.mmap(memory, 0, mmap.MAP_SHARED, mmap.PROT_READ)
        os.close(memory)
        magic, version, self.slots, self.slots_at, self.slot_bytes, self.pixels_at, _ = HEAD.unpack_from(self.memory)
        if (magic, version) != (b"OBSCRING", 1):
            raise RuntimeError(f"no frame ring: {magic} {version}")

    def watch(self, period_us=0):
        self.daemon.call("watch", camera=self.camera, period_us=period_us)

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
        self.daemon.close()


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
