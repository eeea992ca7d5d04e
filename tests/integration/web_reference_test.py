#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The reference of the web interface, docs/reference/web.md, is made of what obscura-web --print-interface writes, and that is OpenAPI 3.1.
Routes of calls of the daemon have the fields of these, as clients/calls.json has them.

Usage: web_reference_test.py OBSCURA-WEB SOURCE-DIRECTORY [--update]
Exit status 1 if the page or a field differs.
"""
import copy
import json
import pathlib
import re
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "clients/stubs"))
import openapi_document  # noqa: E402
from call_table import kind_of  # noqa: E402

web, source = sys.argv[1], pathlib.Path(sys.argv[2])
document = json.loads(subprocess.run([web, "--print-interface"], capture_output=True, text=True, check=True, timeout=60).stdout)


def breaks():
    """Copies of the document, each with one mistake."""
    path = "/api/v1/cameras/{camera}/trigger"
    for change in (lambda d: d.pop("info"), lambda d: d.update(openapi="3.0.0"), lambda d: d["paths"][path]["post"].update(parameters=[]),
                   lambda d: d["paths"][path]["post"]["responses"].update({"600": {"description": ""}}),
                   lambda d: d["components"]["schemas"]["Me"].update(type="objekt"), lambda d: d["paths"][path]["post"].update(operationId="features"),
                   lambda d: d["components"]["schemas"].pop("Count"), lambda d: d["paths"][path]["post"]["responses"]["200"].pop("description"),
                   lambda d: d["components"]["parameters"]["camera"].pop("required"), lambda d: d["paths"][path].update(fetch={}),
                   lambda d: d["components"]["securitySchemes"].clear(), lambda d: d["paths"].update({"nope": {}})):
        broken = copy.deepcopy(document)
        change(broken)
        yield broken


found = openapi_document.mistakes(document)
unseen = sum(not openapi_document.mistakes(broken) for broken in breaks()) if openapi_document.jsonschema else 0
if found or unseen:
    print(*found, f"{unseen} mistakes that were made were not seen", sep="\n")
    sys.exit(1)


CALLS = {call["name"]: call for call in json.loads((source / "clients/calls.json").read_text())["daemon"]}
# Operations whose body is of another form than the fields of their call.
OWN_BODIES = {"features.set", "feature.set", "acquisition", "device.set", "configuration.set"}
# Those of the server itself, and those that make several calls.
WITHOUT_CALL = re.compile(r"page|alive|ready|metrics|state|events|me|audit|openapi|cameras|camera|support-bundle|frame(\.id)?(\.\w+)?|live\.mjpg(\.first)?")
TYPES = {"map": "object", "numbers": "array", "strings": "array", "maps": "array", "list": "array"}


def schema_wanted(field):
    """Schema of a field of the table of calls."""
    kind = kind_of(field["type"])
    wanted = {} if kind == "any" or " or " in kind else {"type": TYPES.get(kind, kind)}
    limits = re.match(r"(\S+) to (\S+)", field.get("allowed", ""))
    if limits:
        wanted.update(minimum=float(limits[1]), maximum=float(limits[2]))
    elif " | " in field.get("allowed", ""):
        wanted["enum"] = field["allowed"].split(" | ")
    items = {"numbers": "number", "strings": "string", "maps": "object"}.get(kind)
    if items:
        wanted["items"] = {"type": items}
    size = re.match(r"array of (\d+) ", field["type"])
    if size:
        wanted.update(minItems=int(size[1]), maxItems=int(size[1]))
    if "unit" in field:
        wanted["x-unit"] = field["unit"]
    if "default" in field:
        wanted["default"] = json.loads(field["default"])
    return wanted


def told_fields(operation):
    """Fields of query and body: meaning, schema, whether they are required."""
    told = {p["name"]: (p["description"], p["schema"], p.get("required", False)) for p in operation.get("parameters", []) if p.get("in") == "query"}
    body = operation.get("requestBody", {"content": {"application/json": {"schema": {}}}})["content"]["application/json"]["schema"]
    for name, field in body.get("properties", {}).items():
        told[name] = (field["description"], {key: value for key, value in field.items() if key != "description"}, name in body.get("required", []))
    return told


def unlike_calls(paths):
    """Fields of routes that are not those of their calls."""
    for item in paths.values():
        for operation in item.values():
            name = operation["operationId"]
            if "x-call" not in operation:
                if not WITHOUT_CALL.fullmatch(name):
                    yield f"{name}: of which call?"
                continue
            call = CALLS[operation["x-call"]]
            if operation["x-role"] != openapi_document.ROLES[call["permission"]]:
                yield f"{name}: role {operation['x-role']}, permission {call['permission']}"
            if name in OWN_BODIES:
                continue
            wanted = {field["name"]: (field["help"], schema_wanted(field), field.get("required", False)) for field in call["fields"] if field["name"] != "camera"}
            told = {field: told for field, told in told_fields(operation).items() if field != "camera"}
            for field in sorted(wanted.keys() | told.keys()):
                if wanted.get(field) != told.get(field):
                    yield f"{name}: {field}: {told.get(field)}, of the call {wanted.get(field)}"


def unlike_calls_after(change):
    broken = copy.deepcopy(document["paths"])
    change(broken)
    return list(unlike_calls(broken))


POSE, PROBE = ("/api/v1/cameras/{camera}/" + name for name in ("pose", "probe"))
POSE_BODY = ("post", "requestBody", "content", "application/json", "schema", "properties")


def inside(paths, *names):
    for name in names:
        paths = paths[name]
    return paths


differences = list(unlike_calls(document["paths"]))
if differences:
    print(*differences, sep="\n")
    sys.exit(1)
seen = [unlike_calls_after(lambda p: inside(p, POSE, *POSE_BODY).pop("velocity_m_s")), unlike_calls_after(lambda p: inside(p, PROBE, "get", "parameters").pop(4)),
        unlike_calls_after(lambda p: inside(p, POSE, *POSE_BODY, "orientation").update(description="Quaternion w, x, y, z; missing: that of the frame")),
        unlike_calls_after(lambda p: inside(p, POSE, *POSE_BODY, "time_s").update(maximum=999999999))]
if any(len(one) != 1 for one in seen):
    print(f"of one difference each that was made were seen: {seen}")
    sys.exit(1)


def cell(text):
    return str(text).replace("|", "\\|")


def allowed(schema):
    unit = f" {schema['x-unit']}" if "x-unit" in schema else ""
    if "enum" in schema:
        return ", ".join(schema["enum"])
    if "maximum" in schema:
        return f"{schema['minimum']:g} to {schema['maximum']:g}{unit}"
    return f"from {schema['minimum']:g}{unit}" if schema.get("minimum") else unit.strip()


def type_of(schema):
    size = f"{schema['minItems']} " if "minItems" in schema else ""
    return f"array of {size}{schema['items']['type']}s" if "items" in schema else schema.get("type", "any")


def meaning(text, schema):
    return text + (f"; default {json.dumps(schema['default'])}" if "default" in schema else "")


def fields(operation):
    """Rows of query and body."""
    for parameter in operation.get("parameters", []):
        if parameter.get("in") == "query":
            yield f"`?{parameter['name']}=`", type_of(parameter["schema"]), allowed(parameter["schema"]), meaning(parameter["description"], parameter["schema"])
    schema = operation.get("requestBody", {"content": {"application/json": {"schema": {}}}})["content"]["application/json"]["schema"]
    for name, field in schema.get("properties", {}).items():
        required = "; required" if name in schema.get("required", []) else ""
        yield f"`{name}`", type_of(field), allowed(field), meaning(field["description"], field) + required


def described(schema):
    """Members of an answer: their names, and those of what they hold."""
    if "$ref" in schema:
        schema = document["components"]["schemas"][schema["$ref"].split("/")[-1]]
    if schema.get("type") == "array" and "items" in schema:
        inner = described(schema["items"])
        return f"[{inner}]" if inner else ""
    names = []
    for name, member in schema.get("properties", {}).items():
        inner = described(member)
        names.append(f"{name}: {inner}" if inner else name)
    return f"{{{', '.join(names)}}}" if names else ""


lines = ["# The interface of obscura-web", "",
         "Generated from `obscura-web --print-interface`, which is the table that the server itself works with; do not edit. How it is meant is in",
         "[control.md](../control.md#over-http). `{camera}` is the `id` of a camera in the answer to `/api/v1/state`. A token stands in the header",
         "`Authorization: Bearer TOKEN`. Bodies are JSON objects, sent as `Content-Type: application/json`. Counts and instants that may exceed 2^53 are texts.",
         "Each change takes a header `Idempotency-Key`, PATCH and PUT `If-Match`, a trigger `Prefer: respond-async`.", ""]
for path, item in document["paths"].items():
    for method, operation in item.items():
        lines += [f"## {method.upper()} {path}", "", f"{operation['summary']}. Role: {operation['x-role'] or 'none, open to all'}.", ""]
        rows = list(fields(operation))
        if rows:
            lines += ["| field | type | allowed | meaning |", "| --- | --- | --- | --- |", *(f"| {' | '.join(cell(c) for c in row)} |" for row in rows), ""]
        for kind, content in operation["responses"]["200"]["content"].items():
            name = content.get("schema", {}).get("$ref", "").split("/")[-1]
            members = described(document["components"]["schemas"][name]) if name else ""
            lines += [f"Answers `{kind}`" + (f": `{members}`" if members else "") + ".", ""]
text = "\n".join(lines).rstrip("\n") + "\n"
file = source / "docs/reference/web.md"
if "--update" in sys.argv:
    file.write_text(text)
elif not file.exists() or file.read_text() != text:
    print(f"{file}: differs from the program's table (web_reference_test.py OBSCURA-WEB . --update writes it)")
    sys.exit(1)
print(f"{len(document['paths'])} paths")
