#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Flies the camera towards the asteroid in ten steps of one second: pose in, frame out.

Usage: lockstep.py [HOST TOKEN-FILE], the token for a camera on another machine
"""
import hmac
import pathlib
import socket
import sys

LOOK_ALONG_X = "0.5 -0.5 0.5 -0.5"  # quaternion (scalar first) from camera axes (x right, y down, z ahead) to the scene's

host, token = (sys.argv[1], pathlib.Path(sys.argv[2]).read_bytes()) if len(sys.argv) > 2 else ("127.0.0.1", b"")
with socket.create_connection((host, 5003)) as connection:
    lines = connection.makefile("rw", encoding="ascii", newline="\n")
    greeting, _, challenge = lines.readline().strip().partition(" challenge=")
    print(greeting)
    if challenge:  # the camera wants to see that the token is known, which itself stays here
        lines.write(f"token {hmac.new(token, bytes.fromhex(challenge), 'sha256').hexdigest()}\n")
        lines.flush()
        if lines.readline().strip() != "welcome":
            raise SystemExit("the camera does not know this token")
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
