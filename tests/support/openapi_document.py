# SPDX-License-Identifier: Apache-2.0
"""Whether a document is one of OpenAPI 3.1: its objects as the specification names them, in JSON Schema 2020-12, and the rules that a schema
cannot tell. Callbacks, links, webhooks and XML are left out: the document has none."""
import re

try:
    import jsonschema
except ImportError:
    jsonschema = None


def thing(needed=(), /, **members):
    """An object with these members and extensions, and no others."""
    return {"type": "object", "required": list(needed), "properties": members, "patternProperties": {"^x-": True}, "additionalProperties": False}


def ref(name):
    return {"$ref": f"#/$defs/{name}"}


def either(name):
    """That object, or a reference to one."""
    return {"if": {"type": "object", "required": ["$ref"]}, "then": ref("reference"), "else": ref(name)}


def named(what):
    return {"type": "object", "additionalProperties": what}


TEXT, FLAG, URI = {"type": "string"}, {"type": "boolean"}, {"type": "string", "pattern": r"^[a-z][a-z0-9+.-]*:"}
# Role of tokens that a permission of the daemon's calls becomes.
ROLES = {"view": "viewer", "operate": "operator", "scene": "operator", "admin": "admin"}
METHODS = ["get", "put", "post", "delete", "options", "head", "patch", "trace"]
PARAMETER = thing(["name", "in"], **{"name": TEXT, "in": {"enum": ["query", "header", "path", "cookie"]}, "description": TEXT, "required": FLAG,
                                     "deprecated": FLAG, "allowEmptyValue": FLAG, "schema": ref("schema"), "content": ref("content"), "style": TEXT,
                                     "explode": FLAG, "example": True, "examples": {"type": "object"}})
PARAMETER["oneOf"] = [{"required": ["schema"]}, {"required": ["content"]}]
PARAMETER["if"] = {"properties": {"in": {"const": "path"}}}
PARAMETER["then"] = {"required": ["required"], "properties": {"required": {"const": True}}}
SCHEME = thing(["type"], **{"type": {"enum": ["apiKey", "http", "mutualTLS", "oauth2", "openIdConnect"]}, "description": TEXT, "scheme": TEXT, "bearerFormat": TEXT,
                            "name": TEXT, "in": TEXT})
SCHEME["if"], SCHEME["then"] = {"properties": {"type": {"const": "http"}}}, {"required": ["scheme"]}
LICENSE = thing(["name"], name=TEXT, identifier=TEXT, url=URI)
LICENSE["not"] = {"required": ["identifier", "url"]}
SECURITY = {"type": "array", "items": named({"type": "array", "items": TEXT})}
SERVERS = {"type": "array", "items": thing(["url"], url=TEXT, description=TEXT, variables={"type": "object"})}
OPENAPI = thing(["openapi", "info"], openapi={"type": "string", "pattern": r"^3\.1\.\d+$"}, jsonSchemaDialect=URI, servers=SERVERS, security=SECURITY,
                info=thing(["title", "version"], title=TEXT, version=TEXT, summary=TEXT, description=TEXT, termsOfService=URI, contact={"type": "object"},
                           license=LICENSE),
                paths={"type": "object", "patternProperties": {"^/": ref("path"), "^x-": True}, "additionalProperties": False},
                components=thing(**{what: {"type": "object", "propertyNames": {"pattern": "^[a-zA-Z0-9._-]+$"}, "additionalProperties": kind} for what, kind in {
                    "schemas": ref("schema"), "responses": either("response"), "parameters": either("parameter"), "requestBodies": either("body"),
                    "headers": {"type": "object"}, "securitySchemes": either("scheme"), "examples": {"type": "object"}}.items()}),
                tags={"type": "array", "items": thing(["name"], name=TEXT, description=TEXT)})
OPENAPI |= {"anyOf": [{"required": ["paths"]}, {"required": ["components"]}], "$schema": "https://json-schema.org/draft/2020-12/schema", "$defs": {
    "reference": {"type": "object", "required": ["$ref"], "properties": {"$ref": TEXT, "summary": TEXT, "description": TEXT}, "additionalProperties": False},
    "schema": {"type": ["object", "boolean"]},  # checked by itself
    "parameter": PARAMETER, "scheme": SCHEME,
    "content": named(thing(schema=ref("schema"), example=True, examples={"type": "object"}, encoding={"type": "object"})),
    "body": thing(["content"], description=TEXT, content=ref("content"), required=FLAG),
    "response": thing(["description"], description=TEXT, headers={"type": "object"}, content=ref("content")),
    "path": thing(summary=TEXT, description=TEXT, servers=SERVERS, parameters=ref("parameters"), **dict.fromkeys(METHODS, ref("operation"))),
    "parameters": {"type": "array", "uniqueItems": True, "items": either("parameter")},
    "operation": thing(tags={"type": "array", "items": TEXT}, summary=TEXT, description=TEXT, operationId=TEXT, parameters=ref("parameters"),
                       requestBody=either("body"), deprecated=FLAG, security=SECURITY, servers=SERVERS,
                       responses={"type": "object", "minProperties": 1, "patternProperties": {r"^[1-5](\d\d|XX)$": either("response"), "^x-": True},
                                  "properties": {"default": either("response")}, "additionalProperties": False}),
}}


def schemas_of(value, path=""):
    """Schemas of the document, with their places."""
    if isinstance(value, dict):
        for key, member in value.items():
            if key == "schema" or path == "/components/schemas":
                yield f"{path}/{key}", member
            else:
                yield from schemas_of(member, f"{path}/{key}")
    elif isinstance(value, list):
        for number, member in enumerate(value):
            yield from schemas_of(member, f"{path}/{number}")


def refs_of(value):
    if isinstance(value, dict):
        if isinstance(value.get("$ref"), str):
            yield value["$ref"]
        for member in value.values():
            yield from refs_of(member)
    elif isinstance(value, list):
        for member in value:
            yield from refs_of(member)


def found(document, pointer):
    """What a reference within the document points to; None: nothing."""
    at = document
    for part in pointer.removeprefix("#/").split("/"):
        at = at.get(part.replace("~1", "/").replace("~0", "~")) if isinstance(at, dict) else None
    return at if pointer.startswith("#/") else None


def mistakes(document):
    """One line for each; without jsonschema only those that a schema cannot tell."""
    lines = []
    if jsonschema:
        jsonschema.Draft202012Validator.check_schema(OPENAPI)
        lines += [f"{error.json_path}: {error.message[:200]}" for error in jsonschema.Draft202012Validator(OPENAPI).iter_errors(document)]
        for place, schema in schemas_of(document):
            try:
                jsonschema.Draft202012Validator.check_schema(schema)
            except jsonschema.SchemaError as error:
                lines.append(f"{place}: {error.message[:200]}")
    lines += [f"{pointer}: points to nothing" for pointer in sorted(set(refs_of(document))) if found(document, pointer) is None]
    seen = set()
    for path, item in document.get("paths", {}).items():
        templates = re.findall(r"{([^}]*)}", path)
        for method in METHODS:
            operation = item.get(method)
            if operation is None:
                continue
            declared = [found(document, p["$ref"]) if "$ref" in p else p for p in item.get("parameters", []) + operation.get("parameters", [])]
            names = [(p.get("in"), p.get("name")) for p in declared if p]
            if len(names) != len(set(names)) or sorted(n for kind, n in names if kind == "path") != sorted(templates):
                lines.append(f"{method} {path}: its parameters are not those of the path, or one stands there twice")
            if operation.get("operationId") in seen:
                lines.append(f"{method} {path}: its operationId is that of another")
            seen.add(operation.get("operationId"))
            for requirement in operation.get("security", document.get("security", [])):
                for scheme in requirement:
                    if scheme not in document.get("components", {}).get("securitySchemes", {}):
                        lines.append(f"{method} {path}: there is no security scheme {scheme}")
    return lines
