#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Requests that hypothesis draws from the interface's own document, right ones and wrong ones: none is answered with a status or a content that the
document does not have, or with a fault of the server.

Usage: web_properties_test.py OBSCURAD OBSCURA-WEB SOURCE-DIRECTORY [EXAMPLES]
Without a number the same 150 requests are made each time. Exit status 77 without hypothesis or jsonschema (Debian packages
python3-hypothesis, python3-jsonschema), 1 if a check failed.
"""
import json
import pathlib
import sys
import tempfile
import time
import urllib.parse

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import web_server  # noqa: E402
from small_daemon import SmallDaemon  # noqa: E402

try:
    import hypothesis
    import jsonschema
    from hypothesis import configuration
    from hypothesis import strategies as st
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

obscurad, web, source = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
EXAMPLES = int(sys.argv[4]) if len(sys.argv) > 4 else None
# Refusals that any path may give, which the document does not repeat for each.
GENERAL = {"405", "431", "413", "400"}
JSON = st.recursive(st.none() | st.booleans() | st.integers(-2**70, 2**70) | st.floats() | st.text(max_size=20),
                    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4), max_leaves=8)
PRINTABLE = st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=40)


def value_of(schema):
    """A value of a schema of the document, or nearly one."""
    kind = schema.get("type")
    if "enum" in schema:
        return st.sampled_from(schema["enum"]) | st.text(max_size=20)
    if kind is None:
        return JSON
    if kind == "boolean":
        return st.sampled_from([True, False])
    if kind == "integer":
        return st.integers(int(schema.get("minimum", 0)) - 1, int(min(schema.get("maximum", 2**60), 2**60)) + 1)
    if kind == "number":
        # Waiting is not what is tested.
        return st.sampled_from([schema.get("minimum", 0), 0.01, -1, schema.get("maximum", 1e300) + 1])
    return st.lists(JSON, max_size=3) if kind == "array" else st.text(max_size=20)


def body_of(name, operation):
    schema = operation["requestBody"]["content"]["application/json"]["schema"]
    if name == "trigger":  # neither is the frame's fate
        return st.just({"wait": False}) | JSON.filter(lambda body: body != {})
    if "properties" not in schema:
        names = st.sampled_from(["Gain", "ExposureTime", "TriggerSource", "BlackLevel", "Width", "AcquisitionFrameRate"]) | st.text(max_size=12)
        return st.dictionaries(names, JSON, max_size=3) | JSON
    right = st.fixed_dictionaries({}, optional={member: value_of(field) for member, field in schema["properties"].items()})
    return right | JSON


@st.composite
def requests(draw, document, camera):
    path, item = draw(st.sampled_from(sorted(document["paths"].items())))
    method, operation = draw(st.sampled_from(sorted(item.items())))
    name = operation["operationId"]
    query = {}
    for parameter in operation.get("parameters", []):
        if parameter.get("in") == "query" and draw(st.booleans()):
            query[parameter["name"]] = str(draw(value_of(parameter["schema"]) | PRINTABLE)).lower()
    if name == "events":
        query["follow"] = "0"  # a stream has no end
    if draw(st.integers(0, 9)) == 0:
        query[draw(PRINTABLE)] = draw(PRINTABLE)
    headers = draw(st.fixed_dictionaries({}, optional={
        "Accept": st.sampled_from(["*/*", "image/fits, image/*;q=0.5", "application/json", "text/html", "image/png;q=x", ";,"]), "If-None-Match": PRINTABLE, "If-Match": st.sampled_from(['"0"', "*", "", 'W/"x", "y"']), "Idempotency-Key": PRINTABLE,
        "Prefer": st.sampled_from(["respond-async", "wait=1", ",;"]), "Accept-Encoding": st.sampled_from(["gzip", "gzip;q=0", "*", ";;"]),
        "Content-Type": st.sampled_from(["application/json", "text/plain", "application/json; charset=utf-8"])}))
    body = None
    if "requestBody" in operation:
        headers.setdefault("Content-Type", "application/json")
        body = json.dumps(draw(body_of(name, operation))).encode() if draw(st.integers(0, 9)) else draw(st.binary(max_size=40))
    where = camera if draw(st.integers(0, 9)) else urllib.parse.quote(draw(st.text(max_size=12)), safe="")
    # A path of an empty part is another path.
    feature = draw(st.sampled_from(["Gain", "ExposureTime", "Width"]) | st.text(min_size=1, max_size=12).map(lambda text: urllib.parse.quote(text, safe="")))
    target = path.replace("{camera}", where or "0-0").replace("{feature}", feature).replace("{frame}", str(draw(st.integers(0, 5) | st.integers(0, 2**64))))
    return name, operation, method.upper(), target + ("?" + urllib.parse.urlencode(query) if query else ""), headers, body


def wrong_with(document, name, operation, answer):
    """What the document does not allow; empty: nothing."""
    status = str(answer.status)
    if answer.status >= 500 and answer.status != 503 or status not in operation["responses"].keys() | GENERAL:
        return f"{name}: status {status}"
    response = operation["responses"].get(status, {"$ref": "#/components/responses/problem"})
    if "$ref" in response:
        response = document["components"]["responses"][response["$ref"].split("/")[-1]]
    if "content" not in response:
        return f"{name}: {status} with a content" if answer.content else ""
    kind = (answer.headers["Content-Type"] or "").split(";")[0]
    if kind not in response["content"]:
        return f"{name}: {status} as {kind}"
    schema = response["content"][kind].get("schema")
    if schema and not answer.headers["Content-Encoding"]:
        resolver = jsonschema.RefResolver("", document)
        errors = [e.message[:200] for e in jsonschema.Draft202012Validator(schema, resolver=resolver).iter_errors(json.loads(answer.text))]
        return f"{name}: {status}: {errors[0]}" if errors else ""
    return ""


with tempfile.TemporaryDirectory(prefix="obscura-web-properties-") as temporary:
    folder = pathlib.Path(temporary)
    configuration.set_hypothesis_home_dir(folder / "hypothesis")  # else it leaves a folder where it is called
    camera = SmallDaemon(folder, obscurad, source, tables=f'[control]\nunix_socket = "{folder}/calls"\n')
    daemon = camera.start()
    server = web_server.Web(web, "--socket", camera.socket, "--role", "admin")
    end = time.monotonic() + web_server.PATIENCE_S
    state = {"daemons": []}
    while not any(daemon["cameras"] for daemon in state["daemons"]) and time.monotonic() < end:
        time.sleep(0.1)
        state = json.loads(server.ask("/api/v1/state").text)
    ident = state["daemons"][0]["cameras"][0]["id"]
    document = json.loads(server.ask("/api/v1/openapi.json").text)
    # An answer without an end has a test of its own.
    document["paths"] = {path: item for path, item in document["paths"].items() if not path.endswith(".mjpg")}
    statuses = {}

    @hypothesis.settings(max_examples=EXAMPLES or 150, deadline=None, derandomize=EXAMPLES is None, database=None,
                         suppress_health_check=list(hypothesis.HealthCheck))
    @hypothesis.given(requests(document, ident))
    def holds(request):
        name, operation, method, target, headers, body = request
        answer = server.ask(target, method, body=body, **headers)
        statuses[answer.status] = statuses.get(answer.status, 0) + 1
        wrong = wrong_with(document, name, operation, answer)
        assert not wrong, f"{wrong}\n{method} {target} {headers} {body}\n{answer.text[:500]}"

    try:
        holds()
        good = True
    except Exception as error:  # hypothesis gathers several into one of its own
        print(f"NOT OK - {error}")
        good = False
    print(f"{'ok' if good else 'NOT OK'} - {sum(statuses.values())} requests are answered as the document says: {dict(sorted(statuses.items()))}")
    seen = statuses.get(200, 0) > 10 and statuses.get(422, 0) > 10
    alive = server.process.poll() is None and server.ask("/livez").status == 200 and daemon.poll() is None
    print(f"{'ok' if seen else 'NOT OK'} - right ones and wrong ones were among them")
    print(f"{'ok' if alive else 'NOT OK'} - server and daemon go on")
    server.end()
    daemon.terminate()
    daemon.wait(web_server.PATIENCE_S)
sys.exit(0 if good and seen and alive else 1)
