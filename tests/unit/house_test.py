#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Holds the tree to its own rules: which folder may include which, that public headers include only
public headers, and that documents name only what exists."""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
ALLOWED = {
    "core": {"core"},
    "config": {"core", "config"},
    "images": {"core", "images"},
    "ephemeris": {"core", "config", "ephemeris"},
    "service": {"core", "config", "service"},
    "terrain": {"core", "config", "images", "terrain"},
    "renderer": {"core", "config", "images", "ephemeris", "terrain", "renderer"},
    "sensors": {"core", "config", "images", "sensors"},
    "sync": {"core", "config", "sync"},
    "transports": {"core", "config", "images", "transports"},
    "emulator": {"core", "config", "images", "ephemeris", "terrain", "renderer", "sensors", "service", "sync", "transports", "emulator"},
    "instrument": {"core", "service", "emulator", "tools", "instrument"},
    "tools": {"core", "config", "images", "ephemeris", "terrain", "renderer", "sensors", "sync", "transports", "emulator", "service", "tools"},
    "web": {"core", "images", "transports", "emulator", "tools", "web"},
}
# Sub-folders of one folder, lowest level first; "." is the folder itself, "name.hpp" a file in it with another level. A
# file may include its own level and those below.
LEVELS = {
    "renderer": [
        {"scene", "packets"},
        {"materials", "mesh_files", "lights"},
        {"shapes", "planets"},
        {"textures", "camera", "scene_files"},
        {"world"},
        {"integrators", "reprojection", "truth"},
        {"."},
    ],
    "transports/gige": [
        {"wire"},
        {"settings.hpp"},
        {"registers"},
        {"genicam", "channels"},
        {"device"},
        {"control"},
        {"."},
    ],
}
# Upward includes that are still there: (file, folder it includes).
UPWARD = set()
complaints = []

for folder, allowed in ALLOWED.items():
    for file in sorted((ROOT / folder).rglob("*.?pp")):
        text = file.read_text()
        name = file.relative_to(ROOT)
        for number, line in enumerate(text.splitlines(), 1):
            match = re.match(r'#include "([a-z_0-9]+)/', line)
            if match and match[1] in ALLOWED and match[1] not in allowed:
                complaints.append(f"{name}:{number}: {folder}/ may not include {match[1]}/")
            if file.suffix == ".hpp" and re.match(r"\s*using namespace ", line):
                complaints.append(f"{name}:{number}: no 'using namespace' in a header")
        if file.suffix == ".hpp" and not text.partition("\n")[2].startswith("// "):
            complaints.append(f"{name}:2: a header begins with one line that says what it is for")

# Every source file names its licence in a form that tools read (SPDX).
for file in sorted(ROOT.rglob("*")):
    path = file.relative_to(ROOT)
    is_source = file.suffix in {".cpp", ".hpp", ".c", ".py", ".sh", ".cmake"} or file.name == "CMakeLists.txt"
    if is_source and path.parts[0] not in {"build", "shared"} and not path.parts[0].startswith("."):
        if "SPDX-License-Identifier: " not in "".join(file.open().readlines()[:2]):
            complaints.append(f"{path}:1: no line 'SPDX-License-Identifier: Apache-2.0'")


def place_of(path, level_of):
    """What LEVELS calls the place of a file, whose path is relative to the folder."""
    if len(path.parts) > 1:
        return path.parts[0]
    return path.name if path.name in level_of else "."


upward = set()
for folder, levels in LEVELS.items():
    level_of = {name: level for level, names in enumerate(levels) for name in names}
    for file in sorted((ROOT / folder).rglob("*.?pp")):
        name = str(file.relative_to(ROOT))
        own = place_of(file.relative_to(ROOT / folder), level_of)
        if own not in level_of:
            complaints.append(f"{name}: {folder}/{own}/ has no level in house_test.py")
            continue
        for number, line in enumerate(file.read_text().splitlines(), 1):
            match = re.match(rf'#include "{folder}/([^"]+)"', line)
            if not match:
                continue
            other = place_of(pathlib.PurePath(match[1]), level_of)
            if level_of.get(other, 0) <= level_of[own]:
                continue
            upward.add((name, other))
            if (name, other) not in UPWARD:
                complaints.append(f"{name}:{number}: {folder}/{own}/ may not include {folder}/{other}/, which stands above it")
for name, other in sorted(UPWARD - upward):
    complaints.append(f"house_test.py: {name} no longer includes {other}/: take the exception out")

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
FOLDERS = "scripts|config|docs|tests|core|images|ephemeris|terrain|renderer|sensors|sync|transports|emulator|instrument|service|clients|tools|systemd|debian|cmake"
documents = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md")),
             *sorted((ROOT / "tests").rglob("README.md"))]
for document in (d for d in documents if d.exists()):
    text = document.read_text()
    name = document.relative_to(ROOT)
    for path in sorted(set(re.findall(rf"(?<![\w./~-])((?:{FOLDERS})/[\w./*-]*)", text))):
        path = path.rstrip("./")
        if not list(ROOT.glob(path)) and not list(document.parent.glob(path)):
            complaints.append(f"{name}: names {path}, which does not exist")
    for link in re.findall(r"\]\(([\w./-]+)(?:#[\w-]*)?\)", text):
        if not (document.parent / link).exists():
            complaints.append(f"{name}: links to {link}, which does not exist")

print("\n".join(complaints) or "the tree keeps its rules")
sys.exit(1 if complaints else 0)
