#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Flies the camera towards the asteroid in ten steps of one second: pose in, frame out."""
import socket

LOOK_ALONG_X = "0.5 -0.5 0.5 -0.5"  # quaternion (scalar first) from camera axes (x right, y down, z ahead) to the scene's

with socket.create_connection(("127.0.0.1", 5003)) as connection:
    lines = connection.makefile("rw", encoding="ascii", newline="\n")
    print(lines.readline().strip())  # the greeting
    for step in range(10):
        for time_s in (step, step + 0.1):  # on both sides of the exposure, so that nothing is extrapolated
            x_m = -60000 + 5000 * time_s
            lines.write(f"pose camera {time_s:.3f} {x_m} 0 0 {LOOK_ALONG_X}\n")
        lines.write(f"step {step}\n")
        lines.flush()
        answer = lines.readline().strip()  # frame NUMBER TIME OUTCOME LATE-ROWS, or error WHY
        print(answer)
        if not answer.startswith("frame"):
            raise SystemExit(1)
