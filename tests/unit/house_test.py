#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Holds the tree to its own rules: which folder may include which, that public headers include only
public headers, and that documents name only what exists."""
import pathlib
import re
import sys

from source_tree import FOLDERS, ROOT

ALLOWED = {
    "core": {"core"},
    "config": {"core", "config"},
    "images": {"core", "images"},
    "models": {"core", "config", "models"},
    "ephemeris": {"core", "config", "ephemeris"},
    "service": {"core", "config", "service"},
    "terrain": {"core", "config", "images", "terrain"},
    "renderer": {"core", "config", "images", "models", "ephemeris", "terrain", "renderer"},
    "sensors": {"core", "config", "images", "models", "sensors"},
    "sync": {"core", "config", "sync"},
    "transports": {"core", "config", "images", "transports"},
    "host": {"core", "config", "images", "service", "host"},
    "emulator": {"core", "config", "images", "models", "ephemeris", "terrain", "renderer", "sensors", "service", "sync", "transports",
                 "host", "emulator"},
    "serve": {"core", "config", "images", "models", "renderer", "sensors", "service", "host", "emulator", "serve"},
    "instrument": {"core", "service", "host", "instrument"},
    "tools": {"core", "config", "images", "models", "ephemeris", "terrain", "renderer", "sensors", "sync", "transports", "emulator",
              "service", "host", "serve", "tools"},
    "web": {"core", "images", "transports", "host", "web"},
}
# Files that are rooms of their own, each with the reason. All other files of a folder are one room: rooms that include
# each other in a circle are a complaint, whatever folders they are in.
OWN_ROOMS = {
    "renderer/renderer.cpp": "composes the passes below it, which read the requests of renderer.hpp",
    "sync/registry.cpp": "lists the kinds of trigger sources below it",
    "transports/gige/settings.hpp": "plain settings that channels and device read; their section is made above, in settings.cpp",
    "transports/registry.cpp": "lists the kinds of transports below it",
}
# Folders below those above that a file may include beside them, each with the reason.
BESIDE = {
    "emulator/control/model_examination.cpp": {"tools/model": "what the verbs say of models, for each kind"},
}
complaints = [f"house_test.py: ALLOWED and the folders of the tree differ in {name}" for name in sorted(set(ALLOWED) ^ set(FOLDERS))]

for folder, allowed in ALLOWED.items():
    for file in sorted((ROOT / folder).rglob("*.?pp")):
        text = file.read_text()
        name = file.relative_to(ROOT)
        for number, line in enumerate(text.splitlines(), 1):
            match = re.match(r'#include "([a-z_0-9]+)/', line)
            beside = any(line.startswith(f'#include "{other}/') for other in BESIDE.get(str(name), {}))
            if match and match[1] in ALLOWED and match[1] not in allowed and not beside:
                complaints.append(f"{name}:{number}: {folder}/ may not include {match[1]}/")
            if file.suffix == ".hpp" and re.match(r"\s*using namespace ", line):
                complaints.append(f"{name}:{number}: no 'using namespace' in a header")
        if file.suffix == ".hpp" and not text.partition("\n")[2].startswith("// "):
            complaints.append(f"{name}:2: a header begins with one line that says what it is for")

# A user's path may be too long, a loop of links or in a folder that must not be entered: what the standard library throws
# then would be taken for a bug. core/io/path_state.hpp has the questions that throw nothing.
THROWING = re.compile(r"\b(?:filesystem|fs)::(absolute|canonical|copy(?:_file)?|create_director(?:y|ies)|current_path|equivalent|exists|"
                      r"file_size|is_\w+|last_write_time|permissions|relative|remove(?:_all)?|rename|resize_file|space|status|"
                      r"symlink_status|temp_directory_path|weakly_canonical)\(")


def arguments(text, begin):
    """The arguments of a call whose parenthesis is open before `begin`."""
    depth, found = 1, [""]
    for letter in text[begin:]:
        depth += (letter in "([{") - (letter in ")]}")
        if depth == 0:
            break
        if letter == "," and depth == 1:
            found.append("")
        else:
            found[-1] += letter
    return [argument.strip() for argument in found]


for folder in ALLOWED:
    for file in sorted((ROOT / folder).rglob("*.?pp")):
        text = file.read_text()
        for call in THROWING.finditer(text):
            last = arguments(text, call.end())[-1]
            # Questions about a status that was read before throw nothing.
            if not re.fullmatch(r"error|ignored|unknown|status|[\w.>-]*error_?|.*symlink_status\(.*, error\)", last):
                line = text.count("\n", 0, call.start()) + 1
                complaints.append(f"{file.relative_to(ROOT)}:{line}: {call[1]} throws here; give it a std::error_code, "
                                  "or see core/io/path_state.hpp")
        for walk in re.finditer(r"for \([^;)]*: [\w:]*directory_iterator\(", text):
            line = text.count("\n", 0, walk.start()) + 1
            complaints.append(f"{file.relative_to(ROOT)}:{line}: the walk throws here; paths_in() of core/io/path_state.hpp does not")

# Every source file names its licence in a form that tools read (SPDX).
for file in sorted(ROOT.rglob("*")):
    path = file.relative_to(ROOT)
    is_source = file.suffix in {".cpp", ".hpp", ".c", ".py", ".sh", ".cmake"} or file.name == "CMakeLists.txt"
    if is_source and path.parts[0] not in {"build", "shared"} and not path.parts[0].startswith("."):
        if "SPDX-License-Identifier: " not in "".join(file.open().readlines()[:2]):
            complaints.append(f"{path}:1: no line 'SPDX-License-Identifier: Apache-2.0'")


def room_of(name):
    """The room of a file: its folder, or the file itself where OWN_ROOMS names it."""
    return name if name in OWN_ROOMS else name.rpartition("/")[0]


def circles(includes):
    """Rooms that include each other (Tarjan's strongly connected components of more than one)."""
    index, low, stack, found = {}, {}, [], []

    def visit(room):
        index[room] = low[room] = len(index)
        stack.append(room)
        for other in sorted(includes.get(room, {})):
            if other not in index:
                visit(other)
            if other in stack:
                low[room] = min(low[room], low[other])
        if low[room] == index[room]:
            members = stack[stack.index(room):]
            del stack[stack.index(room):]
            if len(members) > 1:
                found.append(sorted(members))

    for room in sorted(includes):
        if room not in index:
            visit(room)
    return found


sources = {file.relative_to(ROOT).as_posix(): file for folder in ALLOWED for file in (ROOT / folder).rglob("*.?pp")}
includes = {}
for name, file in sources.items():
    for other in re.findall(r'^#include "([^"]+)"', file.read_text(), re.MULTILINE):
        if other in sources and room_of(other) != room_of(name):
            includes.setdefault(room_of(name), {}).setdefault(room_of(other), f"{name} includes {other}")
for members in circles(includes):
    complaints.append("rooms in a circle: " + ", ".join(members))
    complaints += [f"    {why}" for room in members for other, why in includes[room].items() if other in members]
for name in OWN_ROOMS:
    if name not in sources:
        complaints.append(f"house_test.py: there is no {name}: take it out of OWN_ROOMS")

# The table of folders in docs/architecture.md is the one above.
table = (ROOT / "docs/architecture.md").read_text()
rows = dict(re.findall(r"^\| `(\w+)/` \|[^|]*\|([^|]*)\| `[^|]*` \|$", table, re.MULTILINE))
for folder in sorted(ALLOWED.keys() | rows.keys()):
    written = set(re.findall(r"\w+", rows.get(folder, ""))) | {folder}
    if folder not in rows or written != ALLOWED.get(folder):
        complaints.append(f"docs/architecture.md: the row of {folder}/ differs from what house_test.py allows it to include")

# Public headers are installed alone: they include only each other.
public = {}
for lists in sorted(ROOT.glob("*/**/CMakeLists.txt")):
    if lists.relative_to(ROOT).parts[0] in ALLOWED:
        for headers in re.findall(r"obscura_public_headers\(\w+\s+([^)]+)\)", lists.read_text()):
            public |= {(lists.parent / header).relative_to(ROOT).as_posix(): lists.relative_to(ROOT) for header in headers.split()}
for header, lists in sorted(public.items()):
    if not (ROOT / header).exists():
        complaints.append(f"{lists}: there is no {header}")
        continue
    for included in re.findall(r'^#include "([^"]+)"', (ROOT / header).read_text(), re.MULTILINE):
        if included not in public:
            complaints.append(f"{header}: public, but {included} is not: add that to obscura_public_headers() of its library")

# Documents name only what exists: in backticks, in indented commands, and as links, which are relative to the document.
NAMED = "|".join(["scripts", "docs", "tests", "clients", "systemd", "debian", "cmake", *(set(FOLDERS) - {"web"})])
documents = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md")),
             *sorted((ROOT / "tests").rglob("README.md"))]
for document in (d for d in documents if d.exists()):
    text = document.read_text()
    name = document.relative_to(ROOT)
    for path in sorted(set(re.findall(rf"(?<![\w./~-])((?:{NAMED})/[\w./*-]*)", text))):
        path = path.rstrip("./")
        if not list(ROOT.glob(path)) and not list(document.parent.glob(path)):
            complaints.append(f"{name}: names {path}, which does not exist")
    for link in re.findall(r"\]\(([\w./-]+)(?:#[\w-]*)?\)", text):
        if not (document.parent / link).exists():
            complaints.append(f"{name}: links to {link}, which does not exist")

print("\n".join(complaints) or "the tree keeps its rules")
sys.exit(1 if complaints else 0)
