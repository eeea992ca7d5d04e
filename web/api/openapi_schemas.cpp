// SPDX-License-Identifier: Apache-2.0
#include "web/api/openapi_schemas.hpp"

namespace obscura::web {

// clang-format off
const std::string_view openapi_schemas = R"({
"Problem": {"type": "object", "required": ["type", "status", "title", "detail"], "properties": {
    "type": {"type": "string", "pattern": "^urn:obscura:"}, "status": {"type": "integer", "minimum": 400, "maximum": 599},
    "title": {"type": "string"}, "detail": {"type": "string"},
    "errors": {"type": "array", "items": {"type": "object", "required": ["pointer", "detail"], "properties": {
        "pointer": {"description": "JSON Pointer of what is wrong in the body, or of a parameter of the query", "type": "string"},
        "detail": {"type": "string"}}}}}},
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
        "cameras": {"type": "array", "items": {"$ref": "#/components/schemas/Camera"}}}}}}},
"Cameras": {"type": "object", "required": ["cameras", "error"], "properties": {
    "error": {"description": "Why there is none; else empty", "type": "string"},
    "cameras": {"type": "array", "items": {"type": "object", "required": ["id", "number", "daemon", "config", "address", "acquiring", "verdict"], "properties": {
        "id": {"type": "string", "pattern": "^[0-9]+-[0-9]+$"}, "number": {"description": "In the configuration of its daemon, from 0", "type": "integer"},
        "daemon": {"description": "Its process", "type": "integer"}, "config": {"type": "string"},
        "address": {"description": "Of its GigE Vision side; \"none\": it has none", "type": "string"}, "acquiring": {"type": "boolean"},
        "verdict": {"$ref": "#/components/schemas/Verdict"}}}}}},
"Verdict": {"type": "object", "required": ["health", "text"], "properties": {"health": {"enum": ["good", "idle", "bad"]}, "text": {"type": "string"}}},
"Camera": {"type": "object", "required": ["id", "verdict", "acquiring"], "properties": {
    "id": {"type": "string", "pattern": "^[0-9]+-[0-9]+$"}, "acquiring": {"type": "boolean"}, "controller": {"type": "string"},
    "verdict": {"$ref": "#/components/schemas/Verdict"}}},
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
"SelfTest": {"required": ["scheduling", "p99_us", "rows"], "properties": {
    "rows": {"items": {"required": ["name", "rate_hz", "rows", "p50_us", "p99_us", "max_us"]}}, "text": null}},
"Features": {"required": ["features"], "properties": {"features": {"items": {"$ref": "#/components/schemas/Feature"}}}},
"Feature": {"type": "object", "required": ["name", "value", "type", "locked", "access", "locked_by"], "properties": {
    "name": {"type": "string"}, "value": {}, "type": {"type": "string"}, "unit": {"type": "string"},
    "min": {"type": "number"}, "max": {"type": "number"}, "increment": {"type": "number"}, "allowed": {"type": "string"}, "category": {"type": "string"},
    "help": {"type": "string"}, "access": {"enum": ["rw"]}, "locked": {"description": "Not to be changed while it acquires", "type": "boolean"},
    "locked_by": {"description": "Who or what keeps it from being changed now; null: nothing", "type": ["string", "null"]}}},
"Changed": {"required": ["changed"]},
"Trigger": {"required": ["accepted"], "properties": {
    "edge_tai_ns": {"$ref": "#/components/schemas/Count"}, "frame": {"$ref": "#/components/schemas/Count"}}},
"Acquisition": {"type": "object", "required": ["running", "changed"], "properties": {
    "running": {"type": "boolean"}, "changed": {"type": "boolean"}}},
"Timing": {"required": ["columns", "rows"], "properties": {
    "rows": {"items": {"type": "array", "items": {"type": ["number", "null", "string"]}}}}},
"TimingRows": {"required": ["frame", "acquisition", "lateness_us"], "properties": {"lateness_us": {"items": {"type": ["integer", "null"]}}}},
"Faults": {"required": ["kinds", "rules"], "properties": {
    "kinds": {"items": {"required": ["name", "help"]}}, "rules": {"items": {"required": ["kind"]}}}},
"ImagePoint": {"type": "object", "required": ["x", "y"], "properties": {
    "x": {"type": "number", "x-unit": "px"}, "y": {"type": "number", "x-unit": "px"}}},
"Truth": {"required": ["frame", "bodies", "bodies_of", "stars", "windows", "hot_pixels"], "properties": {
    "bodies_of": {"minimum": 0},
    "bodies": {"maxItems": 64, "items": {"required": ["name", "x", "y", "radius_px", "range_m", "limb", "limb_lit"], "properties": {
        "name": {"type": "string"}, "x": {"type": ["number", "null"], "x-unit": "px"}, "y": {"type": ["number", "null"], "x-unit": "px"},
        "radius_px": {"type": ["number", "null"], "x-unit": "px"}, "range_m": {"type": "number", "x-unit": "m"},
        "limb": {"description": "Points [x, y], px; null between parts that are not connected", "type": "array", "items": {
            "type": ["array", "null"], "minItems": 2, "maxItems": 2, "items": {"type": "number"}}},
        "limb_lit": {"description": "Of each point, whether the Sun shines there", "type": "array", "items": {"type": ["boolean", "null"]}},
        "motion": {"description": "Of the origin from the first to the last row", "type": "object", "required": ["start", "end"], "properties": {
            "start": {"$ref": "#/components/schemas/ImagePoint"}, "end": {"$ref": "#/components/schemas/ImagePoint"}}}}}},
    "stars": {"maxItems": 100, "items": {"required": ["x", "y", "name", "magnitude"], "properties": {
        "x": {"type": "number", "x-unit": "px"}, "y": {"type": "number", "x-unit": "px"},
        "name": {"type": ["string", "null"]}, "magnitude": {"type": "number"}}}},
    "windows": {"maxItems": 32, "items": {"required": ["name", "x", "y", "w", "h", "sensor_x", "sensor_y"], "properties": {
        "name": {"type": "string"}, "x": {"type": "integer"}, "y": {"type": "integer"}, "w": {"type": "integer"}, "h": {"type": "integer"},
        "sensor_x": {"type": "integer"}, "sensor_y": {"type": "integer"}}}},
    "hot_pixels": {"maxItems": 256, "items": {"type": "array", "minItems": 2, "maxItems": 2, "items": {"type": "integer"}}}}},
"Probe": {"required": ["frame", "x", "y", "dn", "electrons", "formula", "bands", "irradiance_w_m2", "body", "range_m",
    "latitude_deg", "longitude_deg", "incidence_deg", "emission_deg", "phase_deg", "row_mid_exposure_tai_ns", "samples"], "properties": {
    "frame": {"$ref": "#/components/schemas/Count"},
    "electrons": {"required": ["estimated", "exact"], "properties": {
        "estimated": {"type": ["number", "null"]}, "exact": {"type": ["number", "null"]}}},
    "bands": {"items": {"required": ["name", "wavelength_nm", "irradiance_w_m2"], "properties": {
        "name": {"type": "string"}, "wavelength_nm": {"type": "array", "items": {"type": "number"}, "x-unit": "nm"},
        "irradiance_w_m2": {"type": "number", "x-unit": "W/m2"}}}},
    "body": {"type": ["string", "null"]}, "range_m": {"type": ["number", "null"]},
    "latitude_deg": {"type": ["number", "null"]}, "longitude_deg": {"type": ["number", "null"]},
    "incidence_deg": {"type": ["number", "null"]}, "emission_deg": {"type": ["number", "null"]}, "phase_deg": {"type": ["number", "null"]},
    "row_mid_exposure_tai_ns": {"$ref": "#/components/schemas/Count"}, "samples": {"type": ["number", "null"]}}},
"Scenes": {"required": ["shown", "scenes"]},
"Scene": {"required": ["file", "camera", "bodies", "lamps", "simulator"], "properties": {
    "scene_time": {"enum": ["nominal", "clock", "tai", "replay"]}, "camera": {"$ref": "#/components/schemas/Placed"},
    "bodies": {"items": {"$ref": "#/components/schemas/Placed"}}, "lamps": {"items": {"$ref": "#/components/schemas/Placed"}},
    "simulator": {"type": ["object", "null"]}}},
"Placed": {"type": "object", "required": ["name", "parent", "motion", "source"], "properties": {
    "name": {"type": "string"}, "parent": {"type": "string"}, "motion": {"type": "string"}, "source": {"enum": ["scene", "simulator"]},
    "newest_pose_s": {"type": ["number", "null"], "x-unit": "s"}}},
"Step": {"required": ["frame", "outcome", "late_rows"]},
"Device": {"required": ["features"], "properties": {
    "features": {"items": {"required": ["name", "category", "type", "value", "writable", "locked"], "properties": {
        "name": {"type": "string"}, "category": {"type": "string"}, "value": {}, "writable": {"type": "boolean"}, "locked": {"type": "boolean"}}}}}},
"Written": {"type": "object", "required": ["written"], "properties": {"written": {"type": "string"}}},
"Released": {"required": ["controller"]},
"LogLevel": {"required": ["level", "before"]},
"Shown": {"type": "object", "required": ["file"], "properties": {"file": {"type": "string"}}},
"Configuration": {"required": ["entries"], "properties": {"entries": {"items": {"required": ["key", "value", "source"]}}}},
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
