#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a batch costs beside the rendering: start-up of a shard, resuming and reading a finished batch. No verdict.

Usage: batch_resume.py OBSCURA [--frames 46000] [--bytes 65536] [--scene demo] [--folder FOLDER]
The finished batch is made up, frames of random bytes and their records; its files are removed at the end. Times are those of
the clock and of the processor. Files are in the page cache: a disk can be slower.
"""
import argparse
import hashlib
import json
import os
import pathlib
import resource
import subprocess
import tempfile
import time

arguments = argparse.ArgumentParser()
arguments.add_argument("obscura")
arguments.add_argument("--frames", type=int, default=46000)
arguments.add_argument("--bytes", type=int, default=65536)
arguments.add_argument("--scene", default="demo")
arguments.add_argument("--folder")
arguments = arguments.parse_args()
SHARD = 100


def timed(what, *words, reads=False):
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    subprocess.run([arguments.obscura, "batch", *map(str, words)], stdout=subprocess.DEVNULL, check=True)
    after, clock_s = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic() - start
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    rate = f", {arguments.frames * arguments.bytes / 1e6 / cpu_s:.0f} MB/s of processor time" if reads else ""
    print(f"{what}: {clock_s:.2f} s, processor {cpu_s:.2f} s{rate}", flush=True)


def finish(batch):
    """Makes up frames and records of a planned batch."""
    plan = hashlib.sha256((batch / "plan.json").read_bytes()).hexdigest()
    version = json.loads((batch / "plan.json").read_text())["version"]
    block = os.urandom(arguments.bytes)
    for shard in range((arguments.frames + SHARD - 1) // SHARD):
        folder = batch / "shards" / f"{shard:05}"
        folder.mkdir(parents=True)
        with open(folder / "shard.jsonl", "w", encoding="utf-8") as records:
            for frame in range(shard * SHARD + 1, min(arguments.frames, (shard + 1) * SHARD) + 1):
                content, name = frame.to_bytes(8, "little") + block[8:], f"frame_{frame:06}.exr"
                (folder / name).write_bytes(content)
                records.write(json.dumps({"frame": frame, "file": name, "bytes": len(content),
                                          "sha256": hashlib.sha256(content).hexdigest(), "seconds": 20.0,
                                          "finished_s": int(time.time()), "host": "node17", "version": version,
                                          "plan": plan}) + "\n")


with tempfile.TemporaryDirectory(prefix="obscura-batch-", dir=arguments.folder) as temporary:
    start_up, finished = pathlib.Path(temporary) / "start", pathlib.Path(temporary) / "finished"
    timed("plan", "plan", arguments.scene, "--frames", 4, "--shard", 1, "--window", "0,0,16x16", "--out", start_up)
    for shard in range(4):
        timed("a shard of one small frame", "run", start_up, "--shard", shard, "--threads", 1)
    subprocess.run([arguments.obscura, "batch", "plan", arguments.scene, "--frames", str(arguments.frames), "--shard", str(SHARD),
                    "--out", finished], stdout=subprocess.DEVNULL, check=True)
    finish(finished)
    print(f"finished batch: {arguments.frames} frames of {arguments.bytes} bytes")
    timed("status", "status", finished)
    timed("run again with --quick", "run", finished, "--quick")
    timed("run again", "run", finished, reads=True)
    timed("verify", "verify", finished, reads=True)
