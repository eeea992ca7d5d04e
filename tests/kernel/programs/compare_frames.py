#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compares images that a video consumer saved with the frames that the daemon's file transport wrote (raw), and their time
stamps with the trigger edges told beside those: compare_frames.py CAPTURED FRAMES-FOLDER WIDTH HEIGHT COUNT [STAMPS]

CAPTURED holds 16-bit images whose first four pixels carry the frame number. STAMPS: one in microseconds a line.
"""
import pathlib
import re
import sys

captured, folder, width, height, count = sys.argv[1:6]
size = 2 * int(width) * int(height)
data = pathlib.Path(captured).read_bytes()
stamps = [int(line) for line in pathlib.Path(sys.argv[6]).read_text().split()] if len(sys.argv) > 6 else None
if len(data) % size or len(data) < size * int(count):
    sys.exit(f"{captured}: {len(data)} bytes are not {count} or more whole images")
seen = []
for i in range(len(data) // size):
    image = data[i * size : (i + 1) * size]
    number = sum(image[2 * k] << (8 * k) for k in range(4))
    frame = pathlib.Path(folder) / f"frame_{number:06}.raw"
    if frame.read_bytes()[8:] != image[8:]:
        sys.exit(f"{captured}: image {i} differs from {frame}")
    if stamps is not None:
        edge = int(re.search(r"^T_EDGE *= *(\d+)", frame.with_suffix(".toml").read_text(), re.M)[1])
        if stamps[i] != edge // 1000:
            sys.exit(f"{captured}: image {i} (frame {number}) has time stamp {stamps[i]} us, its edge was at {edge} ns")
    seen.append(number)
if seen != sorted(seen):
    sys.exit(f"{captured}: frames out of order: {seen}")
print(f"{len(seen)} images ({seen[0]}..{seen[-1]}) are the daemon's frames, every pixel" + (", every time stamp its edge" if stamps else ""))
