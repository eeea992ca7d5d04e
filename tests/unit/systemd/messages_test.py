#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Every line that daemon, instrument and web server can log stands in the table of messages of docs/appliance.md, and the table has no others. The journal's
catalogue, systemd/obscura.catalog, is made from that table.

Usage: messages_test.py [--update]
With --update writes the catalogue. Exit status 1 where the three differ.
"""
import pathlib
import re
import sys
import textwrap

source = pathlib.Path(__file__).resolve().parents[3]
literal = r'((?:"(?:[^"\\]|\\.)*"\s*)+)'
calls = re.compile(r"\blog_(?:error|warning|notice|info|debug)\(\s*" + literal + r"|\.push\(\{[^{}]*?LogLevel::\w+,\s*" + literal
                   + r"|\bleft_out = " + literal
                   + r"|\blog_line\(LogLevel::\w+,[^;]*?,\s*" + literal + r"\)")


def pattern(text):
    text = "".join(re.findall(r'"((?:[^"\\]|\\.)*)"', text)).replace('\\"', '"')
    return re.sub(r"\{[^{}]*\}", "…", text)


logged = {}
for folder in "core", "config", "images", "renderer", "sensors", "sync", "transports", "emulator", "instrument", "web":
    for file in sorted((source / folder).rglob("*.cpp")):
        for match in calls.finditer(file.read_text(encoding="utf-8")):
            logged[pattern(next(group for group in match.groups() if group))] = file.relative_to(source)
section = (source / "docs/appliance.md").read_text(encoding="utf-8").split("\n## Messages\n")[1].split("\n## ")[0]
rows = dict(re.findall(r"^\| `([^`]*)` \| (.*) \|$", section, re.M))
failed = False
for text, file in sorted(logged.items()):
    if text not in rows:
        print(f"{file}: not in the table: {text}")
        failed = True
for text in sorted(rows.keys() - logged.keys()):
    print(f"docs/appliance.md: not logged: {text}")
    failed = True
if len(logged) < 20:
    print(f"only {len(logged)} messages were found in the source")
    failed = True


def message_id(text):
    """As message_id() of core/realtime/log.hpp."""
    value = 0x6C62272E07BB014262B821756295C58D
    for byte in text.encode():
        value = (value ^ byte) * 0x0000000001000000000000000000013B % 2**128
    return f"{value:032x}"


def entry(text, meaning):
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", meaning).replace("`", "")
    sentence = plain[0].upper() + plain[1:] if plain.split()[0].isalpha() else plain
    return f"""-- {message_id(text)}
Subject: {text}
Defined-By: Obscura
Documentation: file:///usr/share/doc/obscura/docs/appliance.md

{textwrap.fill(sentence + ".", 100)}
"""


catalogue = "# SPDX-License-Identifier: Apache-2.0\n# Made by messages_test.py --update from the table of messages of docs/appliance.md; do not edit.\n\n"
catalogue += "\n".join(entry(*row) for row in rows.items())
file = source / "systemd/obscura.catalog"
if sys.argv[1:] == ["--update"]:
    file.write_text(catalogue, encoding="utf-8")
elif not file.exists() or file.read_text(encoding="utf-8") != catalogue:
    print(f"{file}: differs from the table of docs/appliance.md (messages_test.py --update writes it)")
    failed = True
if len({message_id(text) for text in rows}) != len(rows):
    print("two messages have one MESSAGE_ID")
    failed = True
print(f"{len(logged)} messages, {len(rows)} rows")
sys.exit(failed)
