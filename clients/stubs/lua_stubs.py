# SPDX-License-Identifier: Apache-2.0
"""Lua: a function for each call, with annotations of the Lua language server and the kinds of its fields."""
from __future__ import annotations

import pathlib
from typing import Dict, List

from call_table import NOTE, Call, Field, pascal, wrapped

FILE = pathlib.PurePath("clients/lua/obscura/calls.lua")

_TYPES = {"boolean": "boolean", "integer": "integer", "number": "number", "string": "string", "numbers": "number[]",
          "strings": "string[]", "map": "table<string, any>", "maps": "table<string, any>[]", "list": "any[]", "any": "any",
          "string or integer": "string|integer", "string or map": "string|table<string, any>"}
_LISTS = {"numbers", "strings", "maps", "list"}

_HEAD = f"""-- SPDX-License-Identifier: Apache-2.0
-- Calls of rendering server and camera. {NOTE}
-- Each takes a table of fields and returns the head of the answer, and its arrays by name.

local calls = {{}}

"""
_KINDS = """-- What Lua's values do not tell: an empty table is a map or a list, and 4.0 is a whole number where one is wanted.
calls.kinds = {
"""


def _members(fields: List[Field]) -> List[str]:
    """One line a field: the language server knows no continuation."""
    return [f"---@field {field.name}{'' if field.required else '?'} {_TYPES[field.kind]} {field.help}" for field in fields
            if field.kind != "body"]


def _kind(field: Field) -> str:
    return "list" if field.kind in _LISTS else field.kind


def write(calls: List[Call]) -> Dict[pathlib.PurePath, str]:
    """Text of each file."""
    kinds, lines = [], []
    for call in calls:
        told = [f'{field.name} = "{_kind(field)}"' for field in call.fields if _kind(field) in ("map", "list", "integer")]
        if told:
            kinds += wrapped(f'["{call.name}"] = {{{", ".join(told)}}},', "  ", "    ")
    for call in calls:
        name = pascal(call.words)
        if call.fields:
            lines += ["", f"---@class obscura.{name}"] + _members(call.fields)
        given = [result for result in call.results if result.kind != "body"]
        if given:
            lines += ["", f"---@class obscura.{name}Answer"] + _members(given)
        lines += [""] + wrapped(call.help, "--- ", "--- ")
        lines += [f"---@param fields{'' if any(f.required for f in call.fields) else '?'} obscura.{name}"] if call.fields else []
        lines += [f"---@return {f'obscura.{name}Answer' if given else 'table'} head"]
        lines += ["---@return table<string, table> arrays"] if call.has_arrays else []
        parameter, value = ("fields", "fields") if call.fields else ("", "{}")
        lines += [f"function calls:{'_'.join(call.words)}({parameter})", f'  return self:request("{call.name}", {value})', "end"]
    text = _HEAD.rstrip("\n") + "\n\n" + _KINDS + "\n".join(kinds) + "\n}\n" + "\n".join(lines) + "\n\nreturn calls\n"
    return {FILE: text}
