# SPDX-License-Identifier: Apache-2.0
"""C++: a struct for each call, with its fields as members and a struct of its answer, for ask() of obscura_calls.hpp."""
from __future__ import annotations

import pathlib
from typing import Dict, List

from call_table import NOTE, Call, Field, pascal, wrapped

FILE = pathlib.PurePath("clients/cpp/include/obscura_calls.hpp")

_TAKEN = {"boolean": "bool", "integer": "std::int64_t", "number": "double", "string": "std::string",
          "numbers": "std::vector<double>", "strings": "std::vector<std::string>", "map": "Map", "maps": "std::vector<Map>",
          "list": "std::vector<Value>", "any": "Value", "string or integer": "Value", "string or map": "Value"}
# Type in the answer, and how it is read.
_GIVEN = {**{kind: (f"std::optional<{_TAKEN[kind]}>", f"detail::optional<{_TAKEN[kind]}>({{}})")
             for kind in ("boolean", "integer", "number")},
          "string": ("std::string", "{}.string()"), "numbers": ("std::vector<double>", "{}.numbers()"),
          "strings": ("std::vector<std::string>", "detail::strings({})"),
          **{kind: ("Value", "Value({})") for kind in ("map", "maps", "list", "any", "string or integer", "string or map")}}
_RESERVED = set("""and asm auto bool break case catch char class const continue default delete do double else enum explicit export
extern false float for friend goto if inline int long mutable namespace new not operator or private protected public register return
short signed sizeof static struct switch template this throw true try typedef union unsigned using virtual void volatile while
xor name read fields""".split())

_HEAD = f"""// SPDX-License-Identifier: Apache-2.0
// Calls of rendering server and camera as structs, for the C++17 client.
// {NOTE}
// clang-format off
#pragma once

#include "obscura_client.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

/// Requests with typed fields: `ask(client, SceneLoad{{"demo"}}).bodies`. Fields that are not set have the server's default.
namespace obscura::client::calls {{

namespace detail {{

template<typename T>
void put(Map& map, const char* name, const T& value) {{
    map.put(name, Value(value));
}}
template<typename T>
void put(Map& map, const char* name, const std::optional<T>& value) {{
    if (value) map.put(name, Value(*value));
}}
template<typename T>
std::optional<T> optional(ValueView value) {{
    return value.is_nil() ? std::nullopt : std::optional<T>(value.as(T()));
}}
inline std::vector<std::string> strings(ValueView value) {{
    std::vector<std::string> all;
    for (std::size_t i = 0; i < value.size(); ++i) all.push_back(value[i].string());
    return all;
}}

}} // namespace detail

/// Sends a request of this file; returns the head of its answer.
template<typename Request>
typename Request::Result ask(Client& client, const Request& request) {{
    const Answer answer = client.call(Request::name, request.fields());
    return Request::read(answer.map());
}}
"""


def _name(field: Field) -> str:
    return field.name + "_" if field.name in _RESERVED else field.name


def _members(fields: List[Field], types: Dict[str, str], indent: str) -> List[str]:
    lines = []
    for field in fields:
        lines += wrapped(field.help, f"{indent}/// ", f"{indent}/// ", 110)
        lines.append(f"{indent}{types[field.name]} {_name(field)}{{}};")
    return lines


def _struct(call: Call) -> List[str]:
    results = [result for result in call.results if result.kind != "body"]
    about = call.help
    if call.has_arrays:
        about += " Its arrays: client.call(name, fields())."
    lines = ["", *wrapped(about, "/// ", "/// ", 110), f"struct {pascal(call.words)} {{",
             f'    static constexpr const char* name = "{call.name}";']
    lines += _members(call.fields, {f.name: _TAKEN[f.kind] if f.required else f"std::optional<{_TAKEN[f.kind]}>"
                                    for f in call.fields}, "    ")
    lines += ["", "    [[nodiscard]] Map fields() const {", "        Map map;"]
    lines += [f'        detail::put(map, "{field.name}", {_name(field)});' for field in call.fields]
    lines += ["        return map;", "    }", "", "    struct Result {"]
    lines += _members(results, {r.name: _GIVEN[r.kind][0] for r in results}, "        ")
    read = ",\n                ".join(_GIVEN[r.kind][1].format(f'head["{r.name}"]') for r in results)
    parameter = "ValueView head" if results else "ValueView"
    return lines + ["    };", f"    [[nodiscard]] static Result read({parameter}) {{", f"        return {{{read}}};", "    }", "};"]


def write(calls: List[Call]) -> Dict[pathlib.PurePath, str]:
    """Text of each file."""
    lines = _HEAD.splitlines()
    for call in calls:
        lines += _struct(call)
    return {FILE: "\n".join([*lines, "", "} // namespace obscura::client::calls"]) + "\n"}
