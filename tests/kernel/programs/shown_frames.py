#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compares what a stimulator showed, update by update, with the frames that the daemon's file transport wrote (raw):

    shown_frames.py DEVICE-LOG FRAMES-FOLDER WIDTH HEIGHT COUNT [WxH+X+Y...]

The sensor has WIDTH x HEIGHT pixels of 8 bits; windows, if any, stand one below the other in a frame. Fails unless the screen
was, after some update, the sensor as of each frame in turn, and prints how the updates were sent. The last may be on their
way still: each has 20 s.
"""
import pathlib
import re
import sys
import time
import zlib

log, folder = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
width, height, count = map(int, sys.argv[3:6])
windows = [tuple(map(int, re.split(r"[x+]", text))) for text in sys.argv[6:]] or [(width, height, 0, 0)]


def updates_so_far():
    told = log.read_text()
    return re.findall(r"^update \d+: (\d+)x(\d+) at \d+,\d+ (\d+) of (\d+) bytes( LZ4)? crc \w+ screen (\w+)\n", told, re.M)


updates = updates_so_far()
screen = bytearray(width * height)
at = 0
for number in range(1, count + 1):
    pixels = (folder / f"frame_{number:06}.raw").read_bytes()
    stride = max(w for w, _, _, _ in windows)
    row = 0
    for w, h, x, y in windows:
        for k in range(h):
            line = pixels[2 * stride * row : 2 * (stride * row + w)]
            if any(line[1::2]):
                sys.exit(f"frame {number}: digital numbers above 255")
            screen[(y + k) * width + x : (y + k) * width + x + w] = line[::2]
            row += 1
    if len(pixels) != 2 * stride * row:
        sys.exit(f"frame {number} has {len(pixels)} bytes, {2 * stride * row} are expected")
    wanted = f"{zlib.crc32(screen):08x}"
    end = time.monotonic() + 20
    while True:
        while at < len(updates) and updates[at][5] != wanted:
            at += 1
        if at < len(updates) or time.monotonic() > end:
            break
        time.sleep(0.05)
        updates = updates_so_far()
    if at == len(updates):
        sys.exit(f"the screen never showed frame {number} as it is ({wanted})")
    # The same update may be the picture of the next frame as well, when nothing has changed.
whole = sum((int(w), int(h)) == (width, height) for w, h, *_ in updates)
packed = sum(bool(lz4) for *_, lz4, _ in updates)
sent = sum(int(n) for _, _, n, *_ in updates)
print(f"{count} of {count} frames shown as they are; {len(updates)} updates, {whole} of the whole screen, {packed} compressed, "
      f"{sent} bytes of {count * width * height}")
if "raw" in log.name and packed or "lz4" in log.name and not packed or len(windows) > 1 and whole > 1:
    sys.exit("updates were not sent as they should be")
