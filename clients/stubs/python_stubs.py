# SPDX-License-Identifier: Apache-2.0
"""Python: a class with a typed method for each call, and one for asyncio."""
from __future__ import annotations

import pathlib
from typing import Dict, List

from call_table import NOTE, Call, pascal, wrapped

FILE = pathlib.PurePath("clients/python/obscura_client/calls.py")
ASYNC_FILE = pathlib.PurePath("clients/python/obscura_client/aio_calls.py")

_TAKEN = {"boolean": "bool", "integer": "int", "number": "float", "string": "str", "numbers": "Sequence[float]",
          "strings": "Sequence[str]", "map": "Mapping[str, Any]", "maps": "Sequence[Mapping[str, Any]]", "list": "Sequence[Any]",
          "any": "Any", "string or integer": "Union[str, int]", "string or map": "Union[str, Mapping[str, Any]]"}
_GIVEN = {**_TAKEN, "numbers": "List[float]", "strings": "List[str]", "map": "Dict[str, Any]", "maps": "List[Dict[str, Any]]",
          "list": "List[Any]"}

_HEAD = f'''# SPDX-License-Identifier: Apache-2.0
"""Calls of server and daemon as typed methods. {NOTE}"""
from __future__ import annotations

from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple, TypedDict, Union, cast

import numpy

Arrays = Dict[str, numpy.ndarray[Any, Any]]
'''

_ASYNC_HEAD = f'''# SPDX-License-Identifier: Apache-2.0
"""Calls of server and daemon as typed methods for asyncio. {NOTE}"""
from __future__ import annotations

from typing import Any, Awaitable, Callable, Dict, Mapping, Optional, Sequence, Tuple, Union, cast

from .calls import (
    Arrays,
%s)


class AsyncCalls:
    """Every call of rendering server and camera; which of them one has, describe() tells. Fields that are None are left out."""

    def __init__(self, request: Callable[[str, Dict[str, Any]], Awaitable[Tuple[Dict[str, Any], Arrays]]]) -> None:
        self._request = request

    async def _ask(self, name: str, /, **fields: Any) -> Tuple[Dict[str, Any], Arrays]:
        return await self._request(name, {{key: value for key, value in fields.items() if value is not None}})
'''

_CLASS = '''
class Calls:
    """Every call of rendering server and camera; which of them one has, describe() tells. Fields that are None are left out."""

    def __init__(self, request: Callable[[str, Dict[str, Any]], Tuple[Dict[str, Any], Arrays]]) -> None:
        self._request = request

    def _ask(self, name: str, /, **fields: Any) -> Tuple[Dict[str, Any], Arrays]:
        return self._request(name, {key: value for key, value in fields.items() if value is not None})
'''


def _result(call: Call) -> str:
    return pascal(call.words) + "Answer"


def _answer_class(call: Call) -> List[str]:
    lines = ["", "", f"class {_result(call)}(TypedDict, total=False):", f'    """Answer of {call.name}."""', ""]
    for result in call.results:
        if result.kind == "body":
            continue
        lines += wrapped(result.help, "    # ", "    # ")
        lines.append(f"    {result.name}: {_GIVEN[result.kind]}")
    return lines


def _method(call: Call, is_async: bool) -> List[str]:
    parameters = "".join(f"        {field.name}: {_TAKEN[field.kind]},\n" if field.required else
                         f"        {field.name}: Optional[{_TAKEN[field.kind]}] = None,\n" for field in call.fields)
    given = "Dict[str, Any]" if not any(r.kind != "body" for r in call.results) else _result(call)
    answer = f"Tuple[{given}, Arrays]" if call.has_arrays else given
    name = "_".join(call.words)
    define, wait = ("async def", "await ") if is_async else ("def", "")
    lines = ["", f"    {define} {name}(\n        self,\n        *,\n{parameters}    ) -> {answer}:" if parameters else
             f"    {define} {name}(self) -> {answer}:"]
    comment = wrapped(call.help, '        """', "        ")
    for field in call.fields:
        comment += ([""] if len(comment) and field is call.fields[0] else []) + wrapped(
            f"{field.name}: {field.help}", "        ", "            ")
    for result in call.results:
        if result.kind == "body":
            comment += wrapped(f"Array \"{result.name}\": {result.help}", "        ", "            ")
    lines += comment
    lines[-1] += '"""' if len(comment) == 1 else ""
    lines += ['        """'] if len(comment) > 1 else []
    passed = "".join(f", {field.name}={field.name}" for field in call.fields)
    asked = wrapped(f'head, {"arrays" if call.has_arrays else "_"} = {wait}self._ask("{call.name}"{passed})', "        ",
                    "                                ")
    value = "head" if given.startswith("Dict") else f"cast({given}, head)"
    return lines + asked + [f"        return {value}, arrays" if call.has_arrays else f"        return {value}"]


def write(calls: List[Call]) -> Dict[pathlib.PurePath, str]:
    """Text of each file."""
    answered = [call for call in calls if any(result.kind != "body" for result in call.results)]
    lines = _HEAD.splitlines()
    for call in answered:
        lines += _answer_class(call)
    lines += [""] + _CLASS.splitlines()
    waiting = (_ASYNC_HEAD % "".join(f"    {name},\n" for name in sorted(map(_result, answered)))).splitlines()
    for call in calls:
        lines += _method(call, is_async=False)
        waiting += _method(call, is_async=True)
    return {FILE: "\n".join(lines) + "\n", ASYNC_FILE: "\n".join(waiting) + "\n"}
