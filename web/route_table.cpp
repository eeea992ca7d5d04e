// SPDX-License-Identifier: Apache-2.0
#include "web/route_table.hpp"

#include <algorithm>
#include <array>

namespace obscura::web {
namespace {

using Type = Parameter::Type;

constexpr double most_id = 9e15; ///< that a double holds exactly

constexpr std::string_view text_type = "text/plain; charset=utf-8", json_type = "application/json";

constexpr std::array events_query{
    Parameter{"after", Type::integer, "Only lines with a larger id", false, 0, most_id},
    Parameter{"follow", Type::integer, "0: the lines that are there, as JSON; 1: further ones as they come",
              false, 0, 1}};
constexpr std::array audit_query{
    Parameter{"after", Type::integer, "Only changes with a larger id", false, 0, most_id}};
constexpr std::array force_query{Parameter{
    "force", Type::boolean, "Write although a GigE Vision client controls the camera; for the role admin"}};
constexpr std::array timing_query{
    Parameter{"after", Type::integer, "Only frames after this one", false, 0, most_id},
    Parameter{"most", Type::integer, "Largest number of rows", false, 1, 256}};
constexpr std::array frame_query{
    Parameter{"after", Type::integer, "Only a frame with a larger id: that of the last answer", false, 0,
              most_id},
    Parameter{"wait", Type::number, "Longest wait for such a frame", false, 0, 30, "s"}};
constexpr std::array trigger_fields{
    Parameter{"wait", Type::boolean, "Answer when the fate of the frame is known, which is the default"}};
constexpr std::array acquisition_fields{
    Parameter{"running", Type::boolean, "Whether the camera acquires from now on", true}};
constexpr std::array fault_fields{Parameter{
    "rules", Type::array, "Rules as GET has them, instead of those that are armed; none: disarm", true}};
constexpr std::array scene_fields{
    Parameter{"file", Type::string, "Name of a shipped scene, or of a file below control.scenes", true}};

constexpr std::array all_routes{
    Route{Answers::page,
          "GET",
          "/",
          "page",
          {},
          "The page; its files stand below this path",
          "text/html; charset=utf-8"},
    Route{Answers::alive, "GET", "/livez", "alive", {}, "200 while this process answers", text_type},
    Route{Answers::ready, "GET", "/readyz", "ready", Role::viewer,
          "200 if every camera is on time or idle, else 503; the checks", json_type, "Ready"},
    Route{Answers::metrics, "GET", "/metrics", "metrics", Role::viewer,
          "Metrics in the text format of Prometheus", "text/plain; version=0.0.4; charset=utf-8"},
    Route{Answers::state, "GET", "/api/v1/state", "state", Role::viewer, "What the daemons said last",
          json_type, "State"},
    Route{Answers::events, "GET", "/api/v1/events", "events", Role::viewer,
          "Log of the daemons, as server-sent events or as JSON", json_type, "Events", events_query},
    Route{Answers::me, "GET", "/api/v1/me", "me", Role::viewer, "Role and name of the token", json_type,
          "Me"},
    Route{Answers::audit, "GET", "/api/v1/audit", "audit", Role::viewer,
          "The latest changes that were made here, oldest first", json_type, "Audit", audit_query},
    Route{Answers::openapi, "GET", "/api/v1/openapi.json", "openapi", Role::viewer,
          "This interface as OpenAPI 3.1", json_type},
    Route{Answers::features, "GET", "/api/v1/cameras/{camera}/features", "features", Role::viewer,
          "Settings of a camera by their SFNC names", json_type, "Features"},
    Route{Answers::set_features, "PATCH", "/api/v1/cameras/{camera}/features", "features.set", Role::control,
          "Changes settings: all that are named, or none if one is wrong", json_type, "Changed", force_query,
          Body::map},
    Route{Answers::trigger,
          "POST",
          "/api/v1/cameras/{camera}/trigger",
          "trigger",
          Role::control,
          "Triggers a frame of a camera whose TriggerSource is Software; 202 if its fate is not known in "
          "time",
          json_type,
          "Trigger",
          {},
          Body::fields,
          trigger_fields},
    Route{Answers::acquisition,
          "POST",
          "/api/v1/cameras/{camera}/acquisition",
          "acquisition",
          Role::control,
          "Starts or stops the acquisition",
          json_type,
          "Acquisition",
          {},
          Body::fields,
          acquisition_fields},
    Route{Answers::timing, "GET", "/api/v1/cameras/{camera}/timing", "timing", Role::viewer,
          "Instants of the latest frames", json_type, "Timing", timing_query},
    Route{Answers::faults, "GET", "/api/v1/cameras/{camera}/faults", "faults", Role::viewer,
          "Faults that are armed, and those that can be", json_type, "Faults"},
    Route{Answers::set_faults,
          "PUT",
          "/api/v1/cameras/{camera}/faults",
          "faults.set",
          Role::control,
          "Arms faults",
          json_type,
          "Faults",
          {},
          Body::fields,
          fault_fields},
    Route{Answers::truth, "GET", "/api/v1/cameras/{camera}/truth", "truth", Role::viewer,
          "Where bodies and stars are in the newest frame", json_type, "Truth"},
    Route{Answers::scenes, "GET", "/api/v1/cameras/{camera}/scenes", "scenes", Role::viewer,
          "Scenes that can be shown", json_type, "Scenes"},
    Route{Answers::show_scene,
          "PUT",
          "/api/v1/cameras/{camera}/scene",
          "scene.show",
          Role::control,
          "Shows another scene; answers when it is shown",
          json_type,
          "Shown",
          {},
          Body::fields,
          scene_fields},
    Route{Answers::configuration, "GET", "/api/v1/cameras/{camera}/configuration", "configuration",
          Role::viewer, "Every key of the configuration, its value and where that comes from", json_type,
          "Configuration"},
    Route{Answers::frame_json, "GET", "/api/v1/cameras/{camera}/frames/latest.json", "frame.json",
          Role::viewer, "What is known of the newest frame; 204 if none came", json_type, "Frame",
          frame_query},
    Route{Answers::frame_png,
          "GET",
          "/api/v1/cameras/{camera}/frames/latest.png",
          "frame.png",
          Role::viewer,
          "The newest frame, 16 bits a pixel, digital numbers as they are",
          "image/png",
          {},
          frame_query},
    Route{Answers::frame_fits,
          "GET",
          "/api/v1/cameras/{camera}/frames/latest.fits",
          "frame.fits",
          Role::viewer,
          "The newest frame with its metadata",
          "image/fits",
          {},
          frame_query},
    Route{Answers::frame_raw,
          "GET",
          "/api/v1/cameras/{camera}/frames/latest.raw",
          "frame.raw",
          Role::viewer,
          "The newest frame as little-endian numbers of 16 bits, row by row",
          "application/octet-stream",
          {},
          frame_query},
};

/// Whether a path is of that pattern; `camera` receives what stands for "{camera}".
bool is_of(std::string_view path, std::string_view pattern, std::string_view& camera) {
    constexpr std::string_view place = "{camera}";
    const std::size_t at = pattern.find(place);
    if (at == std::string_view::npos) return path == pattern;
    if (path.substr(0, at) != pattern.substr(0, at)) return false;
    const std::string_view rest = path.substr(at);
    const std::string_view id = rest.substr(0, rest.find('/'));
    if (id.empty() || rest.substr(id.size()) != pattern.substr(at + place.size())) return false;
    camera = id;
    return true;
}

} // namespace

std::span<const Route> routes() {
    return all_routes;
}

Match match(std::string_view method, std::string_view path) {
    Match found;
    const std::string_view wanted = method == "HEAD" ? "GET" : method;
    for (const Route& route : all_routes) {
        if (!is_of(path, route.path, found.camera)) continue;
        found.methods.push_back(route.method);
        if (route.method == wanted) found.route = &route;
    }
    return found;
}

} // namespace obscura::web
