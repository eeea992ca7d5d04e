#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What changes around a daemon: the system's clock steps by an hour, forwards and backwards; users of other groups come to
its sockets; a control group leaves it too little memory.

Usage: daemon_surroundings_test.py OBSCURA OBSCURAD SHIFTED-CLOCK-LIBRARY SOURCE-DIRECTORY
Exit status 1 if a check failed. Users and groups need root; without it that part says that it is left out.
"""
import atexit
import json
import os
import pathlib
import re
import resource
import struct
import subprocess
import sys
import tempfile
import time

obscura, obscurad, library, source = (str(pathlib.Path(p).resolve()) for p in sys.argv[1:5])
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from checks import check, failures, until  # noqa: E402
from small_daemon import SmallDaemon  # noqa: E402

processes = []
atexit.register(lambda: [process.kill() for process in processes])
PATIENCE_S = 60


def start(daemon, **options):
    process = subprocess.Popen([obscurad, "--config", str(daemon.config)], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, **options)
    processes.append(process)
    return process


def ask(daemon, *words, **options):
    return subprocess.run([obscura, *words, "--socket", daemon.socket], capture_output=True, text=True, timeout=PATIENCE_S, **options)


def state(daemon):
    done = ask(daemon, "status", "--json")
    return json.loads(done.stdout) if done.stdout.startswith("{") else None


def frames(daemon):
    return len(list((daemon.config.parent / "frames").glob("*.raw")))


def test_clock_steps(folder):
    folder.mkdir()
    shift = folder / "shift"
    shift.write_bytes(struct.pack("l", 0))
    daemon = SmallDaemon(folder, obscurad, source)
    process = start(daemon, env={**os.environ, "LD_PRELOAD": library, "OBSCURA_SHIFT_FILE": str(shift)})
    check("the daemon starts", until(lambda: frames(daemon) > 5, bool), process.poll())
    for name, seconds in ("forwards", 3600), ("backwards", -3600), ("back again", 0):
        with open(shift, "r+b") as file:
            file.write(struct.pack("l", seconds))
        before, begin = frames(daemon), time.monotonic()
        check(f"a step of an hour {name}: frames go on", until(lambda: frames(daemon) >= before + 20, bool), frames(daemon) - before)
        taken = time.monotonic() - begin
        check(f"a step of an hour {name}: at their rate", taken < 6, taken)
        begin = time.monotonic()
        check(f"a step of an hour {name}: the daemon answers", state(daemon) is not None and time.monotonic() - begin < 5)
    process.terminate()
    said = process.communicate(timeout=PATIENCE_S)[1]
    check("it ends well", process.returncode == 0, said)
    check("no heartbeat was missed", "heartbeat" not in said, said)


def test_users(folder):
    if os.geteuid() != 0:
        print("users and groups: left out, needs root")
        return
    owner, friend, stranger, group, other = 30501, 30502, 30503, 30601, 30602
    folder.mkdir()
    daemon = SmallDaemon(folder, obscurad, source, tables=f'[control]\nunix_socket = "{folder}/calls"\n')
    for path in (folder, *folder.rglob("*")):
        os.chown(path, owner, group)
    folder.chmod(0o755)
    process = start(daemon, user=owner, group=group, extra_groups=[], umask=0o077)
    sockets = {"monitor": daemon.socket, "calls": f"{folder}/calls"}
    check("the daemon of a user of its own starts", until(lambda: all(pathlib.Path(s).exists() for s in sockets.values()), bool), process.poll())
    connect = "import socket, sys; s = socket.socket(socket.AF_UNIX); s.connect(sys.argv[1]); print('connected')"
    for name, path in sockets.items():
        mode = os.stat(path)
        check(f"{name}: its user and its group may connect, others not", (mode.st_mode & 0o777, mode.st_uid, mode.st_gid) == (0o660, owner, group), oct(mode.st_mode))
        for who, user, own, more, allowed in (("its user", owner, group, [], True), ("a user of its group", friend, other, [group], True),
                                              ("a user whose first group it is", friend, group, [], True), ("a user of another group", stranger, other, [], False)):
            done = subprocess.run(["/usr/bin/python3", "-c", connect, path], capture_output=True, text=True, user=user, group=own, extra_groups=more)
            check(f"{name}: {who} {'connects' if allowed else 'is refused'}", ("connected" in done.stdout) == allowed and (allowed or "PermissionError" in done.stderr), done.stderr[-300:])
    done = ask(daemon, "status", user=stranger, group=other, extra_groups=[])
    check("a stranger is told that the socket is not for him", done.returncode != 0 and daemon.socket in done.stderr and "ermission" in done.stderr, (done.returncode, done.stderr))
    done = ask(daemon, "status", user=friend, group=other, extra_groups=[group])
    check("a member of the group gets the state", "frames" in done.stdout or done.returncode in (0, 1), (done.returncode, done.stderr))
    process.terminate()
    process.communicate(timeout=PATIENCE_S)
    check("it ends well", process.returncode == 0)


def refused_pool(what, done, frames, side, limit_mib, left_mib, limit_name):
    """That the pool is refused with figures: those that follow from the sensor, and what the limit leaves, to the program's own use."""
    check(f"{what}: refused at the start, by the pool", done.returncode == 69 and "out of memory" not in done.stderr, (done.returncode, done.stderr))
    told = re.search(rf"obscurad\.toml: daemon\.pool_frames = {frames}: ([0-9]+) frames of {side} x {side} pixels, with those that other programs may hold: needs ([0-9.]+) MiB of memory; left are ([0-9.]+) MiB of {limit_name} \(([0-9.]+) MiB\)", done.stderr)
    check(f"{what}: the line has the figures", told, done.stderr)
    if told:
        together, needs, left, limit = map(float, told.groups())
        check(f"{what}: a few frames more than the key has", frames < together < frames + 8, together)
        pixels_mib = together * side * side * 2 / 2**20
        check(f"{what}: needed are the pixels and some for each row", pixels_mib < needs < 1.01 * pixels_mib, needs)
        check(f"{what}: the limit", limit == limit_mib, limit)
        check(f"{what}: what is left", left_mib[0] <= left <= left_mib[1], left)


def test_memory(folder):
    folder.mkdir()
    side, frames = 8192, 12
    daemon = SmallDaemon(folder, obscurad, source, size=(side, side), tables=f"[daemon]\npool_frames = {frames}\n")
    command = [obscurad, "--config", str(daemon.config)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_DATA, (1 << 30, 1 << 30)))
    refused_pool("a limit of the process", done, frames, side, 1024, (256, 1000), "the memory limit of the process")
    if os.geteuid() != 0:
        print("control groups: left out, needs root")
        return
    # Files in place of the kernel's, as a service with MemoryMax=1G has them: 100 MiB in use, 60 of them pages of files.
    group = next((line[4:] for line in pathlib.Path("/proc/self/cgroup").read_text().splitlines() if line.startswith("0::/")), "")
    script = (f'mount -t tmpfs none /sys/fs/cgroup && mkdir -p "/sys/fs/cgroup/{group}" && cd "/sys/fs/cgroup/{group}" && echo {1 << 30} > memory.max && '
              f'echo {100 << 20} > memory.current && echo "file {60 << 20}" > memory.stat && exec "$@"')
    done = subprocess.run(["unshare", "--mount", "sh", "-c", script, "sh", *command], capture_output=True, text=True, timeout=PATIENCE_S)
    if "unshare" in done.stderr or "mount:" in done.stderr:
        print(f"control groups: left out, {done.stderr.strip()}")
        return
    refused_pool("a control group", done, frames, side, 1024, (952, 952), "the memory limit of the control group")


with tempfile.TemporaryDirectory(prefix="obscura-surroundings-") as name:
    pathlib.Path(name).chmod(0o755)
    test_clock_steps(pathlib.Path(name) / "clock")
    test_users(pathlib.Path(name) / "users")
    test_memory(pathlib.Path(name) / "memory")
sys.exit(1 if failures else 0)
