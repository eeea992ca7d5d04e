#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The reference of the web interface, docs/reference/web.md, is made of what obscura-web --print-interface writes, and that is OpenAPI 3.1.

Usage: web_reference_test.py OBSCURA-WEB SOURCE-DIRECTORY [--update]
Exit status 1 if the page differs.
"""
import copy
import json
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import openapi_document  # noqa: E402

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


def cell(text):
    return str(text).replace("|", "\\|")


def allowed(schema):
    unit = f" {schema['x-unit']}" if "x-unit" in schema else ""
    if "enum" in schema:
        return ", ".join(schema["enum"])
    if "maximum" in schema:
        return f"{schema['minimum']:g} to {schema['maximum']:g}{unit}"
    return f"from {schema['minimum']:g}{unit}" if schema.get("minimum") else unit.strip()


def fields(operation):
    """Rows of query and body."""
    for parameter in operation.get("parameters", []):
        if parameter.get("in") == "query":
            yield f"`?{parameter['name']}=`", parameter["schema"]["type"], allowed(parameter["schema"]), parameter["description"]
    schema = operation.get("requestBody", {"content": {"application/json": {"schema": {}}}})["content"]["application/json"]["schema"]
    for name, field in schema.get("properties", {}).items():
        required = "; required" if name in schema.get("required", []) else ""
        yield f"`{name}`", field.get("type", "any"), allowed(field), field["description"] + required


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
