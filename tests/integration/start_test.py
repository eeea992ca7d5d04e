#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A daemon that starts slowly, with a Moon that is made on the fly, answers from its beginning: state with the share that is done and the
time left, refusals with both, and an end within a second where it is asked to.

Usage: start_test.py OBSCURAD OBSCURA SOURCE-DIRECTORY
Exit status 1 if a check failed, 77 without the Python client's packages.
"""
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from children import Child  # noqa: E402
from checks import check, failures  # noqa: E402

obscurad, obscura, source = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]).resolve()
sys.path.insert(0, str(source / "clients/python"))
try:
    import obscura_client
except ImportError as error:
    print(f"SKIPPED: {error}")
    sys.exit(77)

PATIENCE_S = 120  # a busy machine, a sanitizer
# Its size decides how long the start takes, on any machine: pixels of ground, each with tiles of its own.
SIZE = 1024
PERIOD_S = 0.05


def start(folder, ready):
    config = folder / "obscurad.toml"
    config.write_text(f"""[scene]
file = "{source / 'config/scenes/moon-realtime.toml'}"
[sensor.readout]
width = {SIZE}
height = {SIZE}
[render]
samples_per_pixel = 1
[gige]
enabled = false
[control]
unix_socket = "{folder / 'calls.socket'}"
[monitor]
socket = "{folder / 'monitor.socket'}"
""", encoding="utf-8")
    return Child([obscurad, "--config", config, "--ready-file", ready], stderr=subprocess.PIPE, text=True)


def ask(*arguments):
    return subprocess.run([obscura, *arguments], capture_output=True, text=True, timeout=PATIENCE_S)


def wait_for(condition):
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        if found := condition():
            return found
        time.sleep(PERIOD_S)
    return None


def refusal(call):
    try:
        call()
    except obscura_client.ObscuraError as error:
        return str(error)
    return ""


with tempfile.TemporaryDirectory(prefix="obscura-start-") as temporary:
    folder = pathlib.Path(temporary)
    ready, monitor, calls = folder / "ready", str(folder / "monitor.socket"), str(folder / "calls.socket")

    # A client that asks from the beginning sees the end come closer.
    daemon = start(folder, ready)
    wait_for(lambda: pathlib.Path(calls).exists() or daemon.poll() is not None)
    early = obscura_client.Camera(calls)
    shares, texts, left, steps = [], [], [], []
    began = time.monotonic()
    while not ready.exists() and daemon.poll() is None and time.monotonic() < began + PATIENCE_S:
        told = early.state()["daemon"].get("starting")
        if told:
            texts.append(told["text"])
            steps.append(told["step"])
            if told["step"] == "tiles" and "share" in told:
                shares.append(told["share"])
            if "left_s" in told:
                left.append((time.monotonic(), told["left_s"]))
        if len(shares) == 3:
            text = ask("status", "--socket", monitor)
            check("obscura status tells it, with status 1", re.search(r"^  starting: tiles \d+ %", text.stdout, re.M) and text.returncode == 1, text)
            for name, call in {"frame": early.frame, "trigger": early.trigger, "start": early.start, "configuration": early.configuration,
                               "scene.list": early.scenes}.items():
                why = refusal(call)
                check(f"{name} is refused with the progress", re.search(r"starting: tiles \d+ %", why), why)
            check("the log is told", any("starting with" in line["text"] for line in early.events()), early.events())
        time.sleep(PERIOD_S)
    ended = time.monotonic()
    check("the daemon starts", ready.exists(), daemon.poll())
    check("it tells its steps in their order", [s for k, s in enumerate(steps) if k == 0 or s != steps[k - 1]][:2] in (
        ["scene", "tiles"], ["configuration", "scene"], ["tiles", "cameras"]), steps)
    check("the share that is done grows from 0 to 1", len(shares) > 3 and shares == sorted(shares) and 0 <= shares[0] < 0.5 < shares[-1] <= 1, shares)
    # Time left by the end that came: the second half of what was told is to be within a factor of three.
    late = [(t, s) for t, s in left if t > (began + ended) / 2 and ended - t > 2]
    check("the time left is about right", bool(late) and all((ended - t) / 3 < s < 3 * (ended - t) + 2 for t, s in late), late)
    check("texts are for people", any(re.fullmatch(r"starting: tiles \d+ %, \d+ (s|min) left", text) for text in texts), texts[-5:])

    # The same sockets go on.
    check("a connection from before sees the cameras", wait_for(lambda: len(early.state()["cameras"]) == 1 and "starting" not in early.state()["daemon"]))
    check("and has their calls", early.configuration() and early.features() and early.start() in (True, False))
    text = ask("status", "--socket", monitor).stdout
    check("status shows the camera and no start", "camera 0" in text and "starting" not in text, text)
    daemon.send_signal(signal.SIGTERM)
    daemon.communicate(timeout=PATIENCE_S)
    check("the daemon ends well", daemon.returncode == 0, daemon.returncode)

    # SIGTERM while tiles are made.
    for step in ("scene", "tiles"):
        ready.unlink(missing_ok=True)
        daemon = start(folder, ready)

        def at_step():
            text = ask("status", "--json", "--socket", monitor).stdout
            return text and json.loads(text)["daemon"].get("starting", {}).get("step") == step

        check(f"the step {step} is seen", wait_for(at_step))
        asked = time.monotonic()
        daemon.send_signal(signal.SIGTERM)
        _, log = daemon.communicate(timeout=PATIENCE_S)
        took = time.monotonic() - asked
        check(f"SIGTERM ends the start within a second (step {step}, {took:.2f} s)", took < 1 + float(os.environ.get("OBSCURA_SLOWDOWN_S", "0")))
        check("with status 0 and a word", daemon.returncode == 0 and "stopped" in log, (daemon.returncode, log[-300:]))
        check("and it was not ready", not ready.exists())

sys.exit(1 if failures else 0)
