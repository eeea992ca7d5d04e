#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A running daemon is asked what it does, by obscura status and obscura events and by a client of its socket that
follows no rule.

Usage: status_test.py OBSCURAD OBSCURA SOURCE-DIRECTORY
Exit status 1 if a check failed.
"""
import contextlib
import json
import os
import pathlib
import random
import re
import shutil
import signal
import socket
import stat
import struct
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from children import Child  # noqa: E402
from checks import check, failures, until  # noqa: E402

obscurad, obscura, source = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
PATIENCE_S = 60  # a busy machine, a sanitizer


def ask(*arguments):
    return subprocess.run([obscura, *arguments], capture_output=True, text=True, env=environment, timeout=PATIENCE_S)


def wait_for(condition):
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.1)
    return False


def thread_names(pid):
    """Names of the threads of a process; one that ends meanwhile has none."""
    names = set()
    for thread in os.listdir(f"/proc/{pid}/task"):
        with contextlib.suppress(OSError):
            names.add(pathlib.Path(f"/proc/{pid}/task/{thread}/comm").read_text().strip())
    return names


def state():
    answer = ask("status", "--json", "--socket", path)
    return json.loads(answer.stdout) if answer.stdout else {}


def connect():
    client = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    client.connect(path)  # waits while the daemon has not accepted those before
    client.settimeout(PATIENCE_S)
    return client


def complete():
    return sum(camera["camera"]["complete"] for camera in state()["cameras"])  # none while the daemon starts


with tempfile.TemporaryDirectory(prefix="obscura-status-") as temporary:
    folder = pathlib.Path(temporary)
    (folder / "frames").mkdir()
    path = str(folder / "monitor.socket")
    environment = dict(os.environ, XDG_RUNTIME_DIR=str(folder / "runtime"))
    shutil.copy(source / "tests" / "support" / "light_scene.toml", folder / "scene.toml")
    config = folder / "obscurad.toml"
    config.write_text(f"""[scene]
file = "scene.toml"
[trigger]
rate_hz = 10
[gige]
enabled = false
[file]
enabled = true
format = "raw"
directory = "{folder / 'frames'}"
[sensor.readout]
width = 64
height = 48
[monitor]
socket = "{path}"
""")

    missing = ask("status", "--socket", path)
    check("without a daemon the status is 69, in one line", missing.returncode == 69 and
          missing.stderr == f"no daemon answers at {path}: No such file or directory\n", missing)

    log = open(folder / "log", "w", encoding="utf-8")
    daemon = Child([obscurad, "--config", config], stdout=subprocess.DEVNULL, stderr=log, env=environment)
    check("the socket appears", wait_for(lambda: os.path.exists(path)))
    mode = os.stat(path)
    check("the socket is for user and group only", stat.S_IMODE(mode.st_mode) == 0o660, oct(mode.st_mode))
    check("frames are counted", wait_for(lambda: complete() > 3))

    told = state()
    camera = told["cameras"][0]
    check("the state names process and configuration", told["daemon"]["pid"] == daemon.pid and
          told["daemon"]["config"] == str(config), told["daemon"])
    check("every edge is accounted for, but for one in work", 0 <= camera["camera"]["triggers"] - sum(
        camera["camera"][k] for k in ("frames", "missed_triggers", "masked_triggers", "dropped")) <= 1,
        camera["camera"])
    # Threads come and go, such as those that write: the state is of another moment than the list.
    names = until(lambda: ({t["name"] for t in state()["threads"]}, thread_names(daemon.pid)), lambda both: both[0] == both[1])
    check("its threads are those of the kernel", names[0] == names[1], names)
    files = len(list((folder / "frames").glob("*.raw")))
    check("the frames counted are those on disk", files - 1 <= complete(), (files, camera["camera"]))
    text = ask("status", "--socket", path)
    check("the text has the verdict of the state, and the exit status follows it",
          text.returncode == (1 if "NOT GOOD: " in text.stdout else 0) and
          re.search(r"^  (NOT GOOD: |on time: 0 late rows in ).* \d+ s$", text.stdout, re.M), text.stdout)

    log.flush()
    written = (folder / "log").read_text(encoding="utf-8").splitlines()
    events = [json.loads(line) for line in ask("events", "--json", "--socket", path).stdout.splitlines()]
    # Levels from warning on stand before a line's text in the log.
    check("the events are the lines of the log", [e["text"] for e in events[:len(written)]] ==
          [w.split(": ", 1)[1] if w.startswith(("warning: ", "error: ")) else w for w in written],
          (events, written))
    check("events count from 1", [e["id"] for e in events] == list(range(1, len(events) + 1)), events)
    rest = ask("events", "--json", "--after", "1", "--socket", path).stdout.splitlines()
    check("only later events are given", rest and json.loads(rest[0])["id"] == 2, rest)

    # All clients of the socket may look, and nothing else, also those of the user of the daemon.
    for words, status in ((["get", "Gain"], 0), (["features", "Trigger"], 0), (["set", "Gain=3"], 77), (["trigger"], 77), (["stop"], 77)):
        done = ask(*words, "--control", path)
        check(f"obscura {' '.join(words)} at the monitor's socket: {status}", done.returncode == status and
              (status == 0 or "needs the permission" in done.stderr), done)
    check("and nothing has changed", ask("get", "Gain", "--control", path).stdout == "0\n")

    # Bytes of clients that follow no rule; one that never reads, and many that say nothing.
    dice = random.Random(7)
    hello = b"OBSC\1\1" + bytes(2) + struct.pack("<IIQ", 1, 12, 0) + b"\x81\xa4call\xa5hello"
    for _ in range(30):
        client = connect()
        client.sendall(dice.choice([b"", hello]) + dice.choice([dice.randbytes(24), b"{" * 4097, b"OBSC\1\1" + dice.randbytes(60), hello * 70]))
        client.close()
    deaf = connect()
    deaf.sendall(hello)
    crowd = [connect() for _ in range(20)]
    begin = time.monotonic()
    check("others are answered beside them", state() != {})
    check("soon", time.monotonic() - begin < PATIENCE_S / 2)
    before = complete()
    check("frames go on", wait_for(lambda: complete() > before))
    del crowd, client, deaf
    check("clients that have gone leave room", wait_for(lambda: state() != {}))

    daemon.terminate()
    check("the daemon ends well", daemon.wait(PATIENCE_S) == 0)
    check("the socket is gone", not os.path.exists(path))

    # Without a path of its own it is found by its name.
    config.write_text(config.read_text().replace(f'[monitor]\nsocket = "{path}"\n', ""))
    daemon = Child([obscurad, "--config", config], stdout=subprocess.DEVNULL, stderr=log, env=environment)
    name = folder / "runtime" / "obscura" / f"obscurad-{daemon.pid}.socket"
    check("the automatic socket has the process in its name", wait_for(name.exists))
    listed = [json.loads(line)["daemon"]["pid"] for line in ask("status", "--json").stdout.splitlines()]
    check("obscura status finds it", daemon.pid in listed, listed)
    daemon.kill()
    daemon.wait()
    daemon = Child([obscurad, "--config", config], stdout=subprocess.DEVNULL, stderr=log, env=environment)
    second = name.with_name(f"obscurad-{daemon.pid}.socket")
    check("the next daemon removes what a killed one has left", wait_for(lambda: second.exists() and
                                                                        not name.exists()))

    # One of two daemons hangs, and is watched until it is gone.
    config.with_name("other.toml").write_text(config.read_text())
    other = Child([obscurad, "--config", config.with_name("other.toml")], stdout=subprocess.DEVNULL, stderr=log, env=environment)
    third = name.with_name(f"obscurad-{other.pid}.socket")
    check("a second daemon appears beside the first", wait_for(lambda: third.exists() and len(ask("status", "--json").stdout.splitlines()) == 2))
    both = ask("features")
    check("a verb that asks one daemon lists both", both.returncode == 64 and both.stderr.count("\n") == 1 and str(second) in both.stderr and str(third) in both.stderr, both)
    other.send_signal(signal.SIGSTOP)
    told = ask("status", "--json")
    check("beside one that hangs the other is shown, with a line and the status 69", told.returncode == 69 and [json.loads(line)["daemon"]["pid"] for line in
          told.stdout.splitlines()] == [daemon.pid] and told.stderr.endswith(f"obscura status: {third}: no answer within 5 s\n"), told)
    told = ask("metrics", "-o", folder / "metrics.prom")
    check("so are its metrics", told.returncode == 69 and told.stderr.splitlines()[-1].startswith("obscura metrics: ") and "obscura_frames_total" in (folder / "metrics.prom").read_text(), told)
    told = ask("status", "--socket", third)
    check("asked by itself it is told of in a line", told.returncode == 69 and told.stdout == "" and told.stderr.endswith(f"{third}: no answer within 5 s\n"), told)
    other.send_signal(signal.SIGCONT)
    watcher = Child([obscura, "status", "--watch", "0.1", "--json", "--socket", third], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    check("one is watched", json.loads(watcher.stdout.readline())["daemon"]["pid"] == other.pid)
    other.terminate()
    other.wait(PATIENCE_S)
    line = watcher.stderr.readline()
    check("and told of when it has gone", line.startswith("obscura status: ") and str(third) in line, line)
    watcher.send_signal(signal.SIGINT)
    watcher.communicate(timeout=PATIENCE_S)
    check("until the watch is interrupted", watcher.returncode == 69, watcher.returncode)
    daemon.terminate()
    daemon.wait(PATIENCE_S)

    config.write_text(config.read_text() + '[monitor]\nsocket = "off"\n')
    daemon = Child([obscurad, "--config", config, "--ready-file", folder / "ready"],
                              stdout=subprocess.DEVNULL, stderr=log, env=environment)
    check("without a monitor it runs as well", wait_for((folder / "ready").exists) and
          not list((folder / "runtime" / "obscura").iterdir()))
    daemon.terminate()
    daemon.wait(PATIENCE_S)

    config.write_text(config.read_text().replace('"off"', '"relative"'))
    refused = subprocess.run([obscurad, "--check", "--config", config], capture_output=True, text=True)
    check("a path that is no path is refused", refused.returncode == 78 and "monitor.socket" in refused.stderr and
          refused.stderr.count("\n") == 1, refused.stderr)
    log.close()

print(f"{len(failures)} failed" if failures else "all good")
sys.exit(1 if failures else 0)
