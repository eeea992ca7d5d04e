#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The calls of the daemon as constants of C++ (web/api/call_rows.hpp), made from clients/calls.json.

Usage: call_rows.py CALLS OUTPUT
"""
import json
import pathlib
import re
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "clients" / "stubs"))
from call_table import kind_of  # noqa: E402

TYPES = {"boolean": "boolean", "integer": "integer", "number": "number", "string": "string", "map": "object", "numbers": "array",
         "strings": "array", "maps": "array", "list": "array"}
ITEMS = {"numbers": "number", "strings": "string", "maps": "object"}


def literal(text):
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def identifier(*names):
    return "_".join(re.sub(r"\W", "_", name) for name in names)


class Rows:
    """Lines of the constants that rows name."""

    def __init__(self):
        self.lines = []

    def parameter(self, call, row):
        kind = kind_of(row["type"])
        allowed = row.get("allowed", "")
        members = [f".name = {literal(row['name'])}", f".type = Parameter::Type::{TYPES.get(kind, 'any')}", f".help = {literal(row['help'])}"]
        if row.get("required"):
            members.append(".required = true")
        if kind in ("integer", "number"):
            limits = re.match(r"(\S+) to (\S+)", allowed)
            members += [f".min = {limits[1]}, .max = {limits[2]}" if limits else ".min = std::numeric_limits<double>::lowest()"]
        if row.get("unit"):
            members.append(f".unit = {literal(row['unit'])}")
        if kind == "string" and " | " in allowed:
            name = identifier(call, row["name"], "choices")
            self.lines.append(f"inline constexpr std::string_view {name}[] = {{{', '.join(map(literal, allowed.split(' | ')))}}};")
            members.append(f".choices = {name}")
        if kind in ITEMS:
            members.append(f".items = Parameter::Type::{ITEMS[kind]}")
        size = re.match(r"array of (\d+) numbers", row["type"])
        if size:
            members.append(f".size = {size[1]}")
        if "default" in row:
            members.append(f".initial = {literal(row['default'])}")
        return f"Parameter{{{', '.join(members)}}}"

    def parameters(self, call, what, rows):
        """The name of an array of them; arrays of numbers behind the head of an answer are no JSON."""
        made = [self.parameter(call, row) for row in rows if kind_of(row["type"]) != "body"]
        if not made:
            return "{}"
        name = identifier(call, what)
        self.lines += [f"inline constexpr Parameter {name}[] = {{", *(f"    {one}," for one in made), "};"]
        return name

    def call(self, row):
        name, fields = row["name"], row["fields"]
        own = self.parameters(name, "fields", [field for field in fields if field["name"] != "camera"])
        results = self.parameters(name, "results", row["results"])
        has_camera = "true" if len(fields) != len([field for field in fields if field["name"] != "camera"]) else "false"
        return f"CallRow{{{literal(name)}, {literal(row['help'].rstrip('.'))}, {literal(row['permission'])}, {has_camera}, {own}, {results}}}"


rows = Rows()
# Frames of streams are no answers.
calls = [rows.call(row) for row in json.loads(pathlib.Path(sys.argv[1]).read_text())["daemon"] if "frames" not in row]
text = "\n".join(["// Made by call_rows.py of clients/calls.json.", "#pragma once", "", '#include "web/api/call_rows.hpp"', "", "#include <limits>", "#include <string_view>", "",
                  "namespace obscura::web {", "", *rows.lines, "inline constexpr CallRow call_rows[] = {", *(f"    {call}," for call in calls), "};", "",
                  "} // namespace obscura::web", ""])
pathlib.Path(sys.argv[2]).write_text(text)
