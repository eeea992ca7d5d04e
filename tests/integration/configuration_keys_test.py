#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A running daemon that is told to read its configuration again, with one key out of its range, answers with the parser's text and changes nothing;
with what --print-config printed of it, nothing changes either.

Usage: configuration_keys_test.py OBSCURAD OBSCURA-WEB SOURCE-DIRECTORY [EVERY (20)]
Every 20th key that has a range is tried; 1: all of them. Exit status 1 if a check failed.
"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import web_server  # noqa: E402
from small_daemon import SmallDaemon  # noqa: E402

obscurad, web, source = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
EVERY = int(sys.argv[4]) if len(sys.argv) > 4 else 20
failures = []


def check(what, good, detail=""):
    if not good:
        failures.append(what)
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)}", flush=True)


def ranged(lines):
    """Number, key, least and largest value of each line of --print-config whose comment states a range of numbers."""
    table, comment = "", ""
    for number, line in enumerate(lines):
        if line.startswith("["):
            table = line.strip("[]")
        elif line.startswith("#"):
            comment = line
        elif " = " in line:
            allowed = re.search(r"\((\S+) to (\S+?)(?: [^()]*)?\)$", comment)
            if allowed and re.fullmatch(r"-?[0-9.e+-]+", line.split(" = ")[1]):
                yield number, f"{table}.{line.split(' = ')[0]}", float(allowed.group(1)), float(allowed.group(2)), "." in line.split(" = ")[1]


with tempfile.TemporaryDirectory(prefix="obscura-keys-") as temporary:
    folder = pathlib.Path(temporary)
    camera = SmallDaemon(folder, obscurad, source, tables=f'[control]\nunix_socket = "{folder}/calls"\n')
    daemon = camera.start()
    server = web_server.Web(web, "--socket", camera.socket, "--role", "admin")
    end = time.monotonic() + web_server.PATIENCE_S
    state = {"daemons": []}
    # A daemon answers before its cameras are there.
    while not any(daemon["cameras"] for daemon in state["daemons"]) and time.monotonic() < end:
        time.sleep(0.1)
        state = json.loads(server.ask("/api/v1/state").text)
    base = f"/api/v1/cameras/{state['daemons'][0]['cameras'][0]['id']}"

    def values():
        return {entry["key"]: entry["value"] for entry in json.loads(server.ask(f"{base}/configuration").text)["entries"]}

    def reload():
        return server.ask(f"{base}/reload", "POST", body={})

    printed = subprocess.run([obscurad, "--config", camera.config, "--print-config"], capture_output=True, text=True, check=True).stdout
    before = values()
    camera.config.write_text(printed)
    told = reload()
    check("what was printed is taken on, and changes nothing", told.status == 200 and values() == before, told.text)
    tag = server.ask(f"{base}/configuration").headers["ETag"]
    lines = printed.splitlines()
    found = list(ranged(lines))
    check("many keys have a range", len(found) > 100, len(found))
    tried = 0
    for turn, (number, key, least, most, real) in enumerate(found[::EVERY]):
        worse = 2 * abs(most) + 1 if turn % 2 else least - abs(least) - 1
        if not real and abs(worse) >= 2**63:
            continue  # no integer of TOML
        name = lines[number].split(" = ")[0]
        changed = lines[:number] + [f"{name} = {worse!r}" if real else f"{name} = {int(worse)}"] + lines[number + 1:]
        camera.config.write_text("\n".join(changed) + "\n")
        answer = reload()
        detail = json.loads(answer.text).get("detail", "")
        parser = subprocess.run([obscurad, "--config", camera.config, "--check"], capture_output=True, text=True).stderr.strip()
        if answer.status not in (409, 422) or f":{number + 1}:" not in detail or "allowed" not in detail or not parser or parser not in detail:
            check(f"{key} out of range is refused with the parser's text", False, (answer.status, detail, parser))
        tried += 1
    check(f"{tried} of {len(found)} keys out of their ranges are refused with the parser's text", not failures and tried > 0)
    after = server.ask(f"{base}/configuration")
    check("and change nothing", after.headers["ETag"] == tag)
    camera.config.write_text(printed)
    check("after which the right file is taken on", reload().status == 200)
    check("the daemon goes on", daemon.poll() is None)
    server.end()
    daemon.terminate()
    daemon.wait(web_server.PATIENCE_S)
sys.exit(1 if failures else 0)
