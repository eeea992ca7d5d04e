#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Holds names of anonymous namespaces apart: the preset release compiles several source files of a library as one unit. Where
two of them have a function of the same name, the compiler may silently choose the other one's overload; types and constants
of the same name fail as soon as another file moves them into one unit.
"""
import collections
import re
import sys

from source_tree import FOLDERS, ROOT, without_text

FUNCTION = re.compile(r"^(?:\[\[[^\]]*\]\] )?(?:template<[^\n]*>\n)?[\w:<>,&*\[\] ]*?[ &*](\w+)\([^;{}]*\)[^;{}]*\{\}", re.M)

TYPE = re.compile(r"^(?:class|struct|enum class|enum) (?:alignas\([^)]*\) )?(\w+)[^;{}\n]*\{\}", re.M)
CONSTANT = re.compile(r"^(?:inline )?(?:constexpr|const|thread_local|static)\b[^;{}=()]*?[ &*](\w+)(?:\[\w*\])?\s*(?:=|\{\})", re.M)


def outermost(text):
    """The text with what stands in braces left out."""
    depth, out = 0, []
    for c in text:
        if c == "{":
            out += "{}" if depth == 0 else ""
            depth += 1
        elif c == "}":
            depth -= 1
        elif depth == 0:
            out.append(c)
    return "".join(out)


def block_at(text, start):
    depth = 1
    for at in range(start, len(text)):
        depth += {"{": 1, "}": -1}.get(text[at], 0)
        if depth == 0:
            return text[start:at]
    return text[start:]


places = collections.defaultdict(set)
for folder in FOLDERS:
    for file in sorted((ROOT / folder).rglob("*.cpp")):
        name = file.relative_to(ROOT).as_posix()
        library = "/".join(name.split("/")[:2]) if folder == "transports" else folder
        text = without_text(file.read_text())
        for match in re.finditer(r"^namespace \{$", text, re.M):
            around = re.findall(r"^namespace (obscura[\w:]*) \{", text[: match.start()], re.M)
            block = outermost(block_at(text, match.end()))
            for kind, pattern in (("function", FUNCTION), ("type", TYPE), ("constant", CONSTANT)):
                for found in set(pattern.findall(block)) - {"alignas"}:
                    places[library, around[-1] if around else "", kind, found].add(name)
complaints = [f"the {kind} {found} stands in anonymous namespaces of {', '.join(sorted(files))}: give each a name of its own"
              for (library, around, kind, found), files in sorted(places.items()) if len(files) > 1]
print("\n".join(complaints) or f"{len(places)} names of anonymous namespaces are apart")
sys.exit(1 if complaints else 0)
