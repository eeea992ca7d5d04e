#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Holds refusals of a word to one form: a message that lists allowed words also says which of them was likely meant, by the
functions of core/text/suggestion.hpp. Checked is every statement that joins a list behind "allowed", "known are" or "there are"."""
import re
import sys

from source_tree import FOLDERS, ROOT

ASKED = re.compile(r'"[^"]*\b(?:allowed|known are|there are)\b[^"]*"')
SUGGESTS = re.compile(r"\b(?:did_you_mean|suggestion|allowed_words|closest_word)\(")
# Statements that list something else than words a user may have misspelt.
EXCEPTIONS = {
    "core/text/suggestion.cpp": "the functions themselves",
    "models/model/entry_points.cpp": "endings of files, of a name without a known one",
    "renderer/mesh_files/mesh_file.cpp": "endings of files",
    "tools/control/saved_frame.cpp": "endings of files, and a folder",
}


def complaints_of(name, source):
    source = re.sub(r'"(?:\\.|[^"\\\n])*"', lambda text: re.sub("[;{}]", " ", text[0]), re.sub(r"//[^\n]*", "", source))
    for match in re.finditer(r"[^;]+", re.sub(r"[{}]", ";", source)):
        statement = match[0]
        if "fmt::join" in statement and ASKED.search(statement) and not SUGGESTS.search(statement):
            yield f"{name}: a list of allowed words without the nearest one: {' '.join(statement.split())[:120]}"


assert list(complaints_of("x", 'fail(fmt::format("is {}, allowed are {}", w, fmt::join(known, ", ")));'))
assert not list(complaints_of("x", 'fail(fmt::format("is {}, {}", w, allowed_words(w, known)));'))
found = {}
for folder in FOLDERS:
    for file in sorted((ROOT / folder).rglob("*.[ch]pp")):
        name = file.relative_to(ROOT).as_posix()
        found[name] = list(complaints_of(name, file.read_text()))
complaints = [line for name, lines in found.items() if name not in EXCEPTIONS for line in lines]
complaints += [f"{name}: an exception that is no longer needed" for name in EXCEPTIONS if not found.get(name)]
print("\n".join(complaints) or f"{len(found)} files name the nearest of allowed words")
sys.exit(1 if complaints else 0)
