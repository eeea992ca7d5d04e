#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Holds the sizes of the house: lines of a file, files of a folder, lines of a function.

    size_test.py [--list]

Exceptions are named below, each with its reason and the size it may have; one that is no longer needed is a complaint.
"""
import re
import sys

from source_tree import FOLDERS, ROOT, without_text

MAX_LINES, MAX_FILES, MAX_FUNCTION = 500, 45, 80
# (path, or path:function) -> (size allowed, reason)
EXCEPTIONS = {
    "emulator/config/daemon_sections.cpp:section_of": (85, "the table of the section's keys"),
    "instrument/scpi/status_commands.cpp:status_commands": (120, "the table of IEEE 488.2 and status commands"),
    "renderer/lights/star_spectra_table.cpp": (810, "a table of spectra, made by scripts/make-star-spectra"),
    "renderer/lights/star_spectra_table.cpp:star_templates": (800, "a table of spectra, made by scripts/make-star-spectra"),
    "renderer/materials/hapke.cpp:loops": (145, "one loop over a packet, which must vectorise as a whole"),
    "renderer/planets/tile_packets.cpp:begin": (100, "one kernel of six instruction sets"),
    "renderer/planets/tile_packets.cpp:step": (145, "one kernel of six instruction sets"),
    "renderer/scene/scene_keys.cpp:keys_of": (95, "the table of the section's keys"),
    "sensors/kernels.cpp:poisson_row": (90, "one loop of a vector kernel, whose state lives in registers"),
    "sensors/sensor_file.cpp:keys_of": (200, "the table of a detector's keys, in the order of the file"),
    "service/compatible/command_rows.cpp:make_commands": (440, "the table of the published client's commands"),
    "transports/gige/settings.cpp:section_of": (85, "the table of the section's keys"),
}


NOT_FUNCTIONS = re.compile(r"\b(if|for|while|switch|catch|namespace|class|struct|enum|union|else|do|try|return)\b[^)]*$|=\s*$|\b(namespace|class|struct|enum|union)\b")


def functions(source):
    """(name, first line, lines) of the outermost functions with a body."""
    text = without_text(source)
    text = re.sub(r"^[ \t]*#[^\n]*(?:\\\n[^\n]*)*", lambda m: "\n" * m[0].count("\n"), text, flags=re.M)
    depth, start, stack, found = 0, 0, [], []
    inside = None
    for at, c in enumerate(text):
        if c == "{":
            head = text[start:at]
            if inside is None and ")" in head and not NOT_FUNCTIONS.search(head.split("(")[0]):
                name = re.search(r"([~\w:]+)\s*\(", head)
                # An initialiser in a constructor's list is no body: its brace follows a name, not ')' or a specifier.
                if re.search(r"\)[^()]*$", head) and not re.search(r"[,:]\s*\w+\s*$", head):
                    inside = (depth, name[1] if name else "?", text.count("\n", 0, start + len(head) - len(head.lstrip())) + 1)
            stack.append(at)
            depth += 1
            start = at + 1
        elif c == "}":
            depth -= 1
            if inside and depth == inside[0]:
                found.append((inside[1], inside[2], text.count("\n", 0, at) + 1 - inside[2] + 1))
                inside = None
            start = at + 1
        elif c == ";":
            start = at + 1
    return found


sizes = []
for folder in FOLDERS:
    by_folder = {}
    for file in sorted((ROOT / folder).rglob("*.?pp")):
        name = file.relative_to(ROOT).as_posix()
        by_folder[file.parent] = by_folder.get(file.parent, 0) + 1
        source = file.read_text()
        sizes.append((name, source.count("\n"), MAX_LINES, "lines"))
        for function, line, lines in functions(source):
            sizes.append((f"{name}:{function}", lines, MAX_FUNCTION, f"lines, from line {line}"))
    for place, count in by_folder.items():
        sizes.append((place.relative_to(ROOT).as_posix() + "/", count, MAX_FILES, "files"))

complaints, used = [], set()
for name, size, limit, unit in sizes:
    allowed, _ = EXCEPTIONS.get(name, (limit, ""))
    if size > limit and name in EXCEPTIONS:
        used.add(name)
    if size > allowed:
        complaints.append(f"{name}: {size} {unit}; at most {allowed} are allowed")
for name in sorted(set(EXCEPTIONS) - used):
    complaints.append(f"size_test.py: {name} is small enough: take the exception out")
if "--list" in sys.argv:
    for name, size, limit, unit in sorted(sizes, key=lambda s: -s[1] / s[2])[:80]:
        print(f"{size:6} of {limit:3}  {name} ({unit})")
print("\n".join(complaints) or f"{len(sizes)} sizes are within their limits")
sys.exit(1 if complaints else 0)
