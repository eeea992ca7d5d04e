#!/usr/bin/env python3
"""Holds the tree to its own rules: which folder may include which, and that README names only what exists."""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
ALLOWED = {
    "core": {"core"},
    "config": {"core", "config"},
    "images": {"core", "images"},
    "renderer": {"core", "config", "images", "renderer"},
    "sensors": {"core", "config", "images", "sensors"},
    "sync": {"core", "config", "sync"},
    "transports": {"core", "config", "images", "transports"},
    "emulator": {"core", "config", "images", "renderer", "sensors", "sync", "transports", "emulator"},
    "tools": {"core", "config", "images", "renderer", "sensors", "sync", "transports", "emulator", "tools"},
}
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
        if file.suffix == ".hpp" and not text.startswith("// "):
            complaints.append(f"{name}:1: a header begins with one line that says what it is for")

readme = (ROOT / "README.md").read_text()
for path in re.findall(r"`((?:scripts|config|docs|tests|core|images|renderer|sensors|sync|transports|emulator|tools|systemd)/[\w./*-]*)`", readme):
    if not list(ROOT.glob(path.rstrip("/"))):
        complaints.append(f"README.md: names {path}, which does not exist")
for path in re.findall(r"\]\(([\w./-]+)\)", readme):
    if not (ROOT / path).exists():
        complaints.append(f"README.md: links to {path}, which does not exist")

print("\n".join(complaints) or "the tree keeps its rules")
sys.exit(1 if complaints else 0)
