#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What levels cost where every frame is full: instructions of the frames of idle_bench with and without them, counted by
callgrind, which no other program disturbs.

Usage: idle_cost.py IDLE_BENCH [FRAMES (2)]
Exit status 1 if the levels cost more than 2 %.
"""
import os
import re
import subprocess
import sys
import tempfile

MOST = 0.02


# Callgrind counts each byte that "rep stosb" sets, with which memset fills a row, as an instruction.
ENVIRONMENT = {"GLIBC_TUNABLES": "glibc.cpu.x86_rep_stosb_threshold=100000000"}


def instructions(program, kind, frames):
    with tempfile.TemporaryDirectory() as folder:
        run = subprocess.run(["valgrind", "--tool=callgrind", f"--callgrind-out-file={folder}/out", program, kind, str(frames)],
                             check=True, capture_output=True, text=True, env={**os.environ, **ENVIRONMENT})
    return int(re.search(r"Collected : (\d+)", run.stderr)[1])


def main():
    program, frames = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 2
    # The first frame sets up what the others find.
    hold, adapt = (instructions(program, kind, 1 + frames) - instructions(program, kind, 1) for kind in ("hold", "adapt"))
    print(f"{hold / frames / 1e9:.3f} G instructions a frame without levels, {adapt / frames / 1e9:.3f} G with: {100 * (adapt / hold - 1):+.2f} %")
    return 1 if adapt > (1 + MOST) * hold else 0


sys.exit(main())
