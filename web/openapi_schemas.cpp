// SPDX-License-Identifier: Apache-2.0
#include "web/openapi_schemas.hpp"

namespace obscura::web {

// clang-format off
const std::string_view openapi_schemas = R"({
"Problem": {"type": "object", "required": ["type", "status", "title", "detail"], "properties": {
    "type": {"type": "string", "pattern": "^urn:obscura:"}, "status": {"type": "integer", "minimum": 400, "maximum": 599},
    "title": {"type": "string"}, "detail": {"type": "string"},
    "errors": {"type": "array", "items": {"type": "object", "required": ["field", "detail"]}}}},
"Count": {"description": "A whole number as text: it may exceed what a double holds", "type": "string", "pattern": "^-?[0-9]+$"},
"Ready": {"type": "object", "required": ["ready", "checks"], "properties": {
    "ready": {"type": "boolean"}, "checks": {"type": "object", "additionalProperties": {"type": "string"}}}},
"State": {"type": "object", "required": ["age_s", "web", "error", "daemons"], "properties": {
    "age_s": {"type": "number", "x-unit": "s"},
    "web": {"type": "object", "required": ["version", "latency_bounds_us"], "properties": {
        "version": {"type": "string"}, "latency_bounds_us": {"type": "array", "items": {"type": "number"}, "x-unit": "us"}}},
    "error": {"description": "Why there is no daemon; else empty", "type": "string"},
    "daemons": {"type": "array", "items": {"type": "object", "required": ["daemon", "cameras"], "properties": {
        "daemon": {"type": "object", "required": ["pid", "version"], "properties": {
            "pid": {"type": "integer"}, "version": {"type": "string"},
            "control": {"description": "Where it takes calls; empty: nowhere", "type": "string"}}},
        "cameras": {"type": "array", "items": {"type": "object", "required": ["id", "verdict", "acquiring"], "properties": {
            "id": {"type": "string", "pattern": "^[0-9]+-[0-9]+$"},
            "acquiring": {"type": "boolean"}, "controller": {"type": "string"},
            "verdict": {"type": "object", "required": ["health", "text"], "properties": {
                "health": {"enum": ["good", "idle", "bad"]}, "text": {"type": "string"}}}}}}}}}}},
"Events": {"type": "object", "required": ["events"], "properties": {
    "events": {"type": "array", "items": {"type": "object", "required": ["id", "utc", "level", "text", "pid"], "properties": {
        "id": {"type": "integer", "minimum": 1}, "utc": {"type": "string"},
        "level": {"enum": ["error", "warning", "notice", "info", "debug"]}, "text": {"type": "string"}, "pid": {"type": "integer"}}}}}},
"Me": {"type": "object", "required": ["role", "name"], "properties": {
    "role": {"enum": ["viewer", "operator", "admin"]}, "name": {"type": "string"}}},
"Audit": {"type": "object", "required": ["changes", "last"], "properties": {
    "last": {"type": "integer", "minimum": 0},
    "changes": {"type": "array", "items": {"type": "object",
        "required": ["id", "utc", "who", "peer", "what", "camera", "before", "after", "forced"], "properties": {
        "id": {"type": "integer", "minimum": 1}, "utc": {"type": "string"}, "who": {"type": "string"}, "peer": {"type": "string"},
        "what": {"type": "string"}, "camera": {"type": "string"}, "before": {}, "after": {}, "forced": {"type": "boolean"}}}}}},
"Features": {"type": "object", "required": ["features"], "properties": {
    "features": {"type": "array", "items": {"type": "object", "required": ["name", "value", "type", "locked"], "properties": {
        "name": {"type": "string"}, "value": {}, "type": {"type": "string"}, "unit": {"type": "string"},
        "help": {"type": "string"}, "locked": {"type": "boolean"}}}}}},
"Changed": {"type": "object", "required": ["changed"], "properties": {
    "changed": {"description": "All settings that have changed, and their values now", "type": "object"}}},
"Trigger": {"type": "object", "required": ["accepted"], "properties": {
    "accepted": {"type": "boolean"}, "edge_tai_ns": {"$ref": "#/components/schemas/Count"}, "outcome": {"type": "string"},
    "frame": {"$ref": "#/components/schemas/Count"}, "late_rows": {"type": "integer"}, "seconds": {"type": "number", "x-unit": "s"}}},
"Acquisition": {"type": "object", "required": ["running", "changed"], "properties": {
    "running": {"type": "boolean"}, "changed": {"type": "boolean"}}},
"Timing": {"type": "object", "required": ["columns", "rows"], "properties": {
    "columns": {"type": "array", "items": {"type": "string"}},
    "rows": {"type": "array", "items": {"type": "array", "items": {"type": ["number", "null", "string"]}}}}},
"Faults": {"type": "object", "required": ["kinds", "rules"], "properties": {
    "kinds": {"type": "array", "items": {"type": "object", "required": ["name", "help"]}},
    "rules": {"type": "array", "items": {"type": "object", "required": ["kind"]}}}},
"Truth": {"type": "object", "required": ["frame", "bodies"], "properties": {
    "bodies": {"type": "array", "items": {"type": "object", "required": ["name"]}}}},
"Scenes": {"type": "object", "required": ["shown", "scenes"], "properties": {
    "scenes": {"type": "array", "items": {"type": "string"}}}},
"Shown": {"type": "object", "required": ["file"], "properties": {"file": {"type": "string"}}},
"Configuration": {"type": "object", "required": ["entries"], "properties": {
    "entries": {"type": "array", "items": {"type": "object", "required": ["key", "value", "source"]}},
    "sha256": {"type": "string"}}},
"Frame": {"type": "object", "required": ["id", "frame", "trigger", "edge_tai_ns", "width", "height", "bits"], "properties": {
    "id": {"$ref": "#/components/schemas/Count"}, "frame": {"$ref": "#/components/schemas/Count"},
    "trigger": {"$ref": "#/components/schemas/Count"}, "edge_tai_ns": {"$ref": "#/components/schemas/Count"},
    "mid_exposure_tai_ns": {"$ref": "#/components/schemas/Count"},
    "width": {"type": "integer"}, "height": {"type": "integer"}, "bits": {"type": "integer"}, "rows": {"type": "integer"},
    "skipped": {"type": "integer"}, "flags": {"type": "integer"}, "exposure_us": {"type": "number", "x-unit": "us"},
    "gain_db": {"type": "number", "x-unit": "dB"}}}
})";
// clang-format on

} // namespace obscura::web
