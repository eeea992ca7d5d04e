#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""obscura new: files that obscura check accepts, that make frames, and that name every key of the reference.
Usage: new_file_test.py OBSCURA"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile

obscura = sys.argv[1]
failures = []
# Tables that a new file does not mention: more of the same keys.
LEFT_OUT = {"[trigger.line2]", "[trigger.line3]", "[camera.view]", "[[body.height]]", "[[body.albedo]]", "[body.detail]"}
VARIANTS = {"", 'shape = "ellipsoid"', 'material = "lambert"'}


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)}", flush=True)
    if not good:
        failures.append(what)


def call(*arguments, folder):
    done = subprocess.run([obscura, *arguments], capture_output=True, text=True, cwd=folder)
    return done.returncode, done.stdout, done.stderr


def tables_of(text):
    """Keys below each heading, whether they stand behind # or not."""
    tables, keys = {}, set()
    tables[""] = keys
    for line in text.splitlines():
        if heading := re.fullmatch(r"#?(\[+[\w.]+\]+)", line):
            keys = tables.setdefault(heading[1], set())
        elif key := re.match(r"#?(\w+) = ", line):
            keys.add(key[1])
    return tables


def uncommented(text, key):
    """The text with one key that stands behind # given its default."""
    return re.sub(rf"^#({key} = )", r"\1", text, count=1, flags=re.MULTILINE)


for kind, reference in (("camera", "configuration"), ("scene", "scene")):
    with tempfile.TemporaryDirectory(prefix="obscura-new-") as temporary:
        folder = pathlib.Path(temporary)
        status, said, error = call("new", kind, folder=folder)
        file = folder / f"{kind}.toml"
        check(f"new {kind} writes {kind}.toml and says so", status == 0 and file.name in said and file.is_file(), error)
        text = file.read_text()
        status, said, error = call("check", file.name, folder=folder)
        check(f"{kind}: check accepts it", status == 0 and "good" in said, said + error)

        known = json.loads(call("keys", "--of", reference, "--json", folder=folder)[1])
        wanted = {}
        for table in known:
            if table["table"] not in LEFT_OUT and table["variant"] in VARIANTS:
                wanted.setdefault(table["table"], set()).update(key["name"] for key in table["keys"])
        written = tables_of(text)
        check(f"{kind}: every table and key is in it", {k: v for k, v in written.items() if v} == {k: v for k, v in wanted.items() if v},
              {k: wanted.get(k, set()) ^ written.get(k, set()) for k in wanted | written if wanted.get(k, set()) != written.get(k, set())})
        comments = [line for line in text.splitlines() if line.startswith("# ")]
        check(f"{kind}: lines of words are short", max(map(len, comments)) <= 100)
        for key in ("divider", "threads") if kind == "camera" else ("max_bounces", "irradiance_scale"):
            (folder / "more.toml").write_text(uncommented(text, key))
            status, said, error = call("check", "more.toml", folder=folder)
            check(f"{kind}: a key without its # is accepted: {key}", status == 0, error)

        before = file.read_bytes()
        file.write_text("mine")
        status, _, error = call("new", kind, folder=folder)
        check(f"{kind}: a file that exists is kept", status == 64 and "--force" in error and file.read_text() == "mine", error)
        (folder / "link.toml").symlink_to("nowhere.toml")
        status, _, error = call("new", kind, "link.toml", folder=folder)
        check(f"{kind}: so is a link", status == 64 and (folder / "link.toml").is_symlink(), error)
        status, _, error = call("new", kind, "--force", folder=folder)
        check(f"{kind}: but for --force", status == 0 and file.read_bytes() == before, error)
        status, _, error = call("new", kind, "no/such/folder.toml", folder=folder)
        check(f"{kind}: what cannot be created is one line", status == 73 and error.count("\n") == 1, (status, error))

with tempfile.TemporaryDirectory(prefix="obscura-new-") as temporary:
    folder = pathlib.Path(temporary)
    status, _, error = call("new", "sensor", folder=folder)
    check("an unknown kind is refused with those that are known", status == 64 and "camera, scene" in error, error)
    call("new", "camera", "alone.toml", folder=folder)
    check("a new camera without a scene beside it sees a shipped one", '\nfile = "demo"\n' in (folder / "alone.toml").read_text())
    call("new", "scene", folder=folder)
    call("new", "camera", folder=folder)
    text = (folder / "camera.toml").read_text()
    check("a new camera sees the scene beside it", '\nfile = "scene.toml"\n' in text)
    status, said, error = call("capture", "camera.toml", "--format", "raw", "-o", "frames", folder=folder)
    check("and makes a frame", status == 0, error)
    raw = (folder / "frames/frame_000001.raw").read_bytes()
    numbers = [raw[i] + 256 * raw[i + 1] for i in range(0, len(raw), 2)]
    lit, full = sum(n > 300 for n in numbers), sum(n >= 4095 for n in numbers)
    check("that shows something and is not saturated", 0.02 < lit / len(numbers) < 0.6 and full == 0, (lit, full, max(numbers)))

sys.exit(1 if failures else 0)
