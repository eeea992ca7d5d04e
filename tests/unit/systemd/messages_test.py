#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Every line that the daemon can log stands in the table of messages of docs/appliance.md, and the table has no others."""
import pathlib
import re
import sys

source = pathlib.Path(__file__).resolve().parents[3]
literal = r'((?:"(?:[^"\\]|\\.)*"\s*)+)'
calls = re.compile(r"\blog_(?:error|warning|notice|info|debug)\(\s*" + literal + r"|\.push\(\{[^{}]*?LogLevel::\w+,\s*" + literal
                   + r"|\blog_line\(LogLevel::\w+,\s*fmt::format\(\s*" + literal + r"|\bwrite_line\(LogLevel::\w+,\s*fmt::format\(\s*" + literal)


def pattern(text):
    text = "".join(re.findall(r'"((?:[^"\\]|\\.)*)"', text)).replace('\\"', '"')
    return re.sub(r"\{[^{}]*\}", "…", text)


logged = {}
for folder in "core", "config", "renderer", "sensors", "sync", "transports", "emulator":
    for file in sorted((source / folder).rglob("*.cpp")):
        for match in calls.finditer(file.read_text(encoding="utf-8")):
            logged[pattern(next(group for group in match.groups() if group))] = file.relative_to(source)
# Text that was made elsewhere: an error's, described by its own row.
logged = {text: file for text, file in logged.items() if text != "…"}
section = (source / "docs/appliance.md").read_text(encoding="utf-8").split("\n## Messages\n")[1].split("\n## ")[0]
documented = set(re.findall(r"^\| `([^`]*)` \|", section, re.M))
general = {text for text in documented if "WHY" in text or "COUNTERS" in text}
failed = False
for text, file in sorted(logged.items()):
    if text not in documented:
        print(f"{file}: not in the table: {text}")
        failed = True
for text in sorted(documented - general - set(logged)):
    print(f"docs/appliance.md: nobody logs: {text}")
    failed = True
if len(logged) < 20:
    print(f"only {len(logged)} messages were found in the source")
    failed = True
print(f"{len(logged)} messages, {len(documented)} rows")
sys.exit(failed)
