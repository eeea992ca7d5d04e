#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Every verb that asks a running daemon finds it in one way: the only one, one by its socket, or by the name of its configuration.

Usage: find_daemon_test.py OBSCURAD OBSCURA SOURCE-DIRECTORY
Exit status 1 if a check failed.
"""
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from children import Child  # noqa: E402
from checks import check, failures  # noqa: E402

obscurad, obscura, source = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]).resolve()
PATIENCE_S = 60
UNAVAILABLE, USAGE = 69, 64
# What verbs want beside the daemon; of others nothing.
ARGUMENTS = {"get": ["ExposureTime"], "set": ["ExposureTime=2000"], "frame": ["-o", "FOLDER/frame.png"], "probe": ["1", "1"], "scene show": ["demo"],
             "fault add": ["drop"], "support-bundle": ["-o", "FOLDER/bundle.tar.gz"]}


def ask(verb, *arguments):
    return subprocess.run([obscura, *verb.split(), *arguments], capture_output=True, text=True, env=environment, timeout=PATIENCE_S)


def start(name, monitor):
    config = folder / f"{name}.toml"
    config.write_text(f"""[scene]
file = "scene.toml"
[gige]
enabled = false
[sensor.readout]
width = 64
height = 48
[monitor]
socket = "{monitor}"
[control]
unix_socket = "auto"
""", encoding="utf-8")
    ready = folder / f"{name}.ready"
    daemon = Child([obscurad, "--config", config, "--ready-file", ready], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment)
    end = time.monotonic() + PATIENCE_S
    while not ready.exists() and time.monotonic() < end:
        time.sleep(0.05)
    return daemon


def verbs():
    """Verbs with the option, by their help."""
    names = re.findall(r"^  ([a-z-]+(?: [a-z-]+)?)  +\S", ask("--help").stdout.split("First steps")[0], re.M)
    return [name for name in names if "--socket" in ask(name, "--help").stdout]


with tempfile.TemporaryDirectory(prefix="obscura-find-") as temporary:
    folder = pathlib.Path(temporary)
    environment = dict(os.environ, XDG_RUNTIME_DIR=str(folder / "runtime"))
    (folder / "runtime").mkdir(mode=0o700)
    shutil.copy(source / "tests/support/light_scene.toml", folder / "scene.toml")
    asking = verbs()
    check("verbs that ask daemons are found by their help", len(asking) >= 15 and {"status", "get", "frame", "scene list", "events"} <= set(asking), asking)
    one = start("bench-one", "auto")
    other = start("other", "auto")
    own = start("own-path", folder / "own.socket")
    help_of = {verb: re.search(r"--socket DAEMON.*", ask(verb, "--help").stdout) for verb in asking}
    check("the option is the same everywhere", all(help_of.values()), help_of)
    for verb in asking:
        rest = [argument.replace("FOLDER", str(folder)) for argument in ARGUMENTS.get(verb, [])]
        for how in ("bench-one", str(folder / "own.socket")):
            answer = ask(verb, "--socket", how, *rest)
            check(f"{verb} finds it by {pathlib.Path(how).name}", answer.returncode not in (UNAVAILABLE, USAGE), (answer.returncode, answer.stderr[-300:]))
        if verb == "support-bundle":  # says in the bundle what was missing
            continue
        answer = ask(verb, "--socket", "nobody", *rest)
        check(f"{verb} says which there are", answer.returncode == UNAVAILABLE and all(word in answer.stderr for word in ("nobody", "bench-one", "other")), answer)
    for daemon in (one, other, own):
        daemon.send_signal(signal.SIGTERM)
        daemon.wait(PATIENCE_S)

sys.exit(1 if failures else 0)
