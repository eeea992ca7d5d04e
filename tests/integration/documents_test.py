#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Holds the documents to the programs: every key, verb and option that they name exists.
Usage: documents_test.py OBSCURA OBSCURAD"""
import functools
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
obscura, obscurad = sys.argv[1:3]
SCENE_TABLES = {"sun", "stars", "body", "body.height", "body.albedo", "body.detail", "lamp", "band", "stray_light", "global"}
FILE_ENDINGS = {"md", "hpp", "cpp", "csv", "toml", "service", "py"}
complaints = []


def output(*command):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return done.returncode, done.stdout


def known_keys():
    """Tables of a configuration that has one of each, and their keys."""
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "every.toml"
        file.write_text(f"""
[scene]
file = "{ROOT}/config/scenes/demo.toml"
[trigger.line1]
source = "timer"
[camera]
[[camera.window]]
width = 16
height = 16
[[gige.faults]]
kind = "lose"
[sensor]
[sensor.readout]
width = 640
height = 512
""")
        status, text = output(obscurad, "--config", str(file), "--print-config")
        if status != 0:
            sys.exit(f"FAILED: obscurad --print-config: {text}")
    tables, keys = {}, set()
    for line in text.splitlines():
        if table := re.match(r"\[+([\w.]+)\]+", line):
            keys = tables.setdefault(table[1], set())
        elif key := re.match(r"(\w+) = ", line):
            keys.add(key[1])
    # Not printed beside a window, and tables that are there once more.
    tables["camera"] |= {"width", "height", "offset_x", "offset_y"}
    tables["trigger.line2"] = tables["trigger.line3"] = tables["trigger.line1"]
    return tables


@functools.cache
def help_of(program, verb=""):
    return output(program, *verb.split(), "--help")


@functools.cache
def verbs():
    """All verbs of obscura, of one word or two."""
    return set(re.findall(r"^  ([a-z-]+(?: [a-z-]+)?)  ", help_of(obscura)[1].partition("Verbs:")[2], re.MULTILINE))


def check_command(place, command):
    """`command` is a line that calls obscura or obscurad."""
    words = command.split()
    program, verb = obscurad, ""
    if words[0] == "obscura":
        program = obscura
        if len(words) > 1 and words[1].startswith("-"):
            return
        verb = words[1] if len(words) > 1 else ""
        if not re.fullmatch(r"[a-z]+", verb):
            return
        if " ".join(words[1:3]) in verbs():
            verb = " ".join(words[1:3])
    status, text = help_of(program, verb)
    if status != 0:
        complaints.append(f"{place}: there is no `{words[0]} {verb}`")
        return
    for option in re.findall(r"(?:^|\s)(--?[a-z][a-z-]*)", command):
        if not re.search(rf"(?:^|[\s,]){option}\b", text, re.MULTILINE) and option not in ("--help", "-h"):
            complaints.append(f"{place}: {words[0]} {verb} has no {option}")


def scene_lines(text):
    """Numbers of the lines of scene files, which have a [camera] of their own: code with a [[body]], blank lines included."""
    found, code = set(), []
    for number, line in enumerate([*text.splitlines(), "end"], 1):
        if line.startswith("    ") or (code and not line.strip()):
            code.append((number, line.strip()))
            continue
        if any(inner == "[[body]]" for _, inner in code):
            found |= {at for at, _ in code}
        code = []
    return found


def check_block(name, lines, tables):
    table = None
    for number, line in lines:
        place = f"{name}:{number}"
        line = line.strip()
        if re.match(r"obscurad? ", line):
            check_command(place, re.split(r"\s+#|[|;&]", line)[0])
        elif heading := re.match(r"\[+([a-z][\w.]*)\]+\s*(?:#.*)?$", line):
            table = heading[1]
            if table not in tables and table not in SCENE_TABLES:
                complaints.append(f"{place}: there is no table [{table}]")
        elif (key := re.match(r"(?:# )?([a-z]\w*) = ", line)) and table in tables:
            own_tables = set(tables) | {"view"} if table == "camera" else set()
            if key[1] not in tables[table] | own_tables:
                complaints.append(f"{place}: [{table}] has no key {key[1]}")


tables = known_keys()
for document in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]:
    name, block = document.relative_to(ROOT), []
    scenes = scene_lines(document.read_text())
    for number, line in enumerate(document.read_text().splitlines(), 1):
        if line.startswith("    "):
            if number not in scenes:
                block.append((number, line))
            continue
        check_block(name, block, tables)
        block = []
        for code in re.findall(r"`([^`]+)`", line):
            if re.match(r"obscurad? (?!\w+ \d+$)[a-z-]", code):
                check_command(f"{name}:{number}", code)
            for table, key in re.findall(r"(?<![\w./-])((?:sensor\.)?[a-z]\w*)\.(\w+)\b(?![\w./(-])", code):
                if table in tables and key not in FILE_ENDINGS and key not in tables[table] and f"{table}.{key}" not in tables:
                    complaints.append(f"{name}:{number}: [{table}] has no key {key}")
    check_block(name, block, tables)

print("\n".join(complaints) or "keys, verbs and options in the documents exist")
sys.exit(1 if complaints else 0)
