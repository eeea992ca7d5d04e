# SPDX-License-Identifier: Apache-2.0
"""The source tree as the tests of the house see it: its folders, and sources without comments and texts."""
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]
# Top folders of libraries and programs, in no order.
FOLDERS = sorted(path.parent.name for path in ROOT.glob("*/CMakeLists.txt") if any(path.parent.rglob("*.hpp"))
                 and path.parent.name not in {"build", "clients", "tests"})

_TEXT = re.compile(r'R"(\w*)\((?:.|\n)*?\)\1"|//[^\n]*|/\*(?:.|\n)*?\*/|"(?:\\.|[^"\\\n])*"|(?<![0-9a-fA-F])\'(?:\\.|[^\'\\\n])+\'')


def without_text(source):
    """The source with comments, strings and characters blanked, lines and columns kept."""
    return _TEXT.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), source)
