#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Models by the thousand to a daemon that runs at 10 Hz: late rows and memory before and after. Texts are those of a shipped law with up to
20 letters replaced at random, so that most have mistakes; each is read, lowered, made machine code and checked by the call model.check.

Usage: model_stream.py OBSCURAD OBSCURA [--seconds N] [--model FILE]
Prints one line. Exit status 1 if a row was late more than in the time before, fewer than 10,000 texts were checked in a minute, or the memory grew
by more than 5 %.
"""
import argparse
import pathlib
import random
import sys
import tempfile
import time

root = pathlib.Path(__file__).resolve().parents[2]
options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
options.add_argument("obscurad")
options.add_argument("obscura")
options.add_argument("--seconds", type=float, default=60)
options.add_argument("--model", type=pathlib.Path, default=root / "config/models/hapke.brdf")
options = options.parse_args()
sys.argv[1:] = [options.obscura, str(root)]
sys.path.insert(0, str(root / "tests/support"))
from client_checks import PATIENCE_S, obscura_client, wait_for  # noqa: E402
from small_daemon import SmallDaemon  # noqa: E402

LETTERS = "(){};*+-/=|,. abcxyz019\n"


def memory_kb(pid):
    return next(int(line.split()[1]) for line in open(f"/proc/{pid}/status") if line.startswith("VmRSS"))


def damaged(text, choose):
    letters = list(text)
    for _ in range(choose.choice([0, 1, 3, 20])):
        letters[choose.randrange(len(letters))] = choose.choice(LETTERS)
    return "".join(letters)


with tempfile.TemporaryDirectory(prefix="obscura-model-stream-", ignore_cleanup_errors=True) as temporary:
    folder = pathlib.Path(temporary)
    small = SmallDaemon(folder, options.obscurad, root, tables=f'[control]\nunix_socket = "{folder}/calls"\n[models]\nfolder = "{folder}/models"\n')
    daemon = small.start("--ready-file", folder / "ready")
    try:
        wait_for(lambda: (folder / "ready").exists())
        with obscura_client.connect_camera(str(folder / "calls"), timeout_s=PATIENCE_S) as camera:
            def late_rows():
                return camera.call("state")["cameras"][0]["camera"]["late_rows"]

            def during(work):
                begin, end, count = late_rows(), time.monotonic() + options.seconds, 0
                while time.monotonic() < end:
                    work()
                    count += 1
                return late_rows() - begin, count

            before, _ = during(lambda: time.sleep(0.1))
            choose, text, sound = random.Random(1), options.model.read_text(), []
            memory = memory_kb(daemon.pid)
            late, count = during(lambda: sound.append(camera.call("model.check", file=options.model.name, text=damaged(text, choose))["sound"]))
            after = memory_kb(daemon.pid)
    finally:
        daemon.terminate()
        daemon.wait(PATIENCE_S)
print(f"{count} texts in {options.seconds:g} s, {sum(sound)} of them sound; late rows {before} without, {late} with them; "
      f"memory {memory / 1024:.1f} to {after / 1024:.1f} MiB")
sys.exit(late > before or count < options.seconds / 60 * 10_000 or after > 1.05 * memory)
