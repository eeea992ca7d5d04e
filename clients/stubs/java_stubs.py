# SPDX-License-Identifier: Apache-2.0
"""Java: a class for each call, with a setter for each field and a record of its answer."""
from __future__ import annotations

import html
import pathlib
from typing import Dict, List

from call_table import NOTE, Call, Field, camel, pascal, wrapped

FOLDER = pathlib.PurePath("clients/java/src/main/java/obscura/client/calls")

# Types of a setter's argument, one setter each; what of it is sent.
_TAKEN = {"boolean": ["boolean"], "integer": ["long"], "number": ["double"], "string": ["String"], "numbers": ["double..."],
          "strings": ["String..."], "map": ["Map<String, ?>"], "maps": ["List<? extends Map<String, ?>>"], "list": ["List<?>"],
          "any": ["Object"], "string or integer": ["String", "long"], "string or map": ["String", "Map<String, ?>"]}
_GIVEN = {"boolean": ("Boolean", "(Boolean) {}"), "integer": ("Long", "(Long) {}"), "number": ("Double", "number({})"),
          "string": ("String", "(String) {}"), "numbers": ("List<Double>", "numbers({})"),
          "strings": ("List<String>", "strings({})"), "map": ("Map<String, Object>", "map({})"),
          "maps": ("List<Map<String, Object>>", "maps({})"), "list": ("List<Object>", "list({})"),
          "any": ("Object", "{}"), "string or integer": ("Object", "{}"), "string or map": ("Object", "{}")}
_RESERVED = set("""abstract assert boolean break byte case catch char class const continue default do double else enum extends
final finally float for goto if implements import instanceof int interface long native new package private protected public
return short static strictfp super switch synchronized this throw throws transient try void volatile while true false null clone
finalize getClass hashCode notify notifyAll toString wait""".split())


def _name(field: Field) -> str:
    name = camel(field.name.replace(".", "_").split("_"))
    return name + "_" if name in _RESERVED else name


def _comment(text: str, indent: str) -> List[str]:
    lines = wrapped(_text(text), f"{indent} * ", f"{indent} * ")
    return [f"{indent}/** {lines[0][len(indent) + 3:]} */"] if len(lines) == 1 else [f"{indent}/**", *lines, f"{indent} */"]


def _text(words: str) -> str:
    return html.escape(words, quote=False).replace("@", "&#64;")


def _setter(kind: str, owner: str, field: Field) -> List[str]:
    name = _name(field)
    value = "value.clone()" if kind.endswith("...") else "value"
    return ["", *_comment(field.help + ".", "    "), f"    public {owner} {name}({kind} value) {{",
            f'        fields.put("{field.name}", {value});', "        return this;", "    }"]


def _list(begin: str, items: List[str], end: str, first: str, others: str) -> List[str]:
    """Items with commas, lines of which break between items only."""
    text = ", ".join(item.replace(" ", "\0") for item in items)
    return [line.replace("\0", " ") for line in wrapped(begin + text + end, first, others, 114)]


def _answer(call: Call, results: List[Field]) -> List[str]:
    lines = ["", "    /**", f"     * Answer of {call.name}; null is what the server did not send.", "     *"]
    for result in results:
        lines += wrapped(f"@param {_name(result)} {_text(result.help)}", "     * ", "     *     ")
    components = [f"{_GIVEN[r.kind][0]} {_name(r)}" for r in results]
    lines += ["     */", *_list("public record Result(", components, ")", "    ", "            ")]
    lines[-1] += " {}"
    read = [_GIVEN[r.kind][1].format(f'head.get("{r.name}")') for r in results]
    return lines + ["", "    @Override", "    public Result read(Map<String, Object> head) {",
                    *_list("return new Result(", read, ");", "        ", "                "), "    }"]


def _class(call: Call) -> str:
    owner = pascal(call.words)
    results = [result for result in call.results if result.kind != "body"]
    lines = ["// SPDX-License-Identifier: Apache-2.0", f"// {NOTE}", "package obscura.client.calls;", "",
             "import java.util.List;", "import java.util.Map;", "import obscura.client.Call;", "", *_comment(call.help, ""),
             f"public final class {owner} extends Call<{f'{owner}.Result' if results else 'Void'}> {{",
             "    /** A request without fields. */", f"    public {owner}() {{", f'        super("{call.name}");', "    }"]
    for field in call.fields:
        for kind in _TAKEN[field.kind]:
            lines += _setter(kind, owner, field)
    if not results:
        lines += ["", "    @Override", "    public Void read(Map<String, Object> head) {", "        return null;", "    }", "}"]
    else:
        lines += _answer(call, results) + ["}"]
    text = "\n".join(lines) + "\n"
    if "List<" not in text:
        text = text.replace("import java.util.List;\n", "")
    return text


def write(calls: List[Call]) -> Dict[pathlib.PurePath, str]:
    """Text of each file."""
    files = {FOLDER / f"{pascal(call.words)}.java": _class(call) for call in calls}
    files[FOLDER / "package-info.java"] = ("// SPDX-License-Identifier: Apache-2.0\n/** Calls of rendering server and camera. "
                                           f"{NOTE.replace('`', '')} */\npackage obscura.client.calls;\n")
    return files
