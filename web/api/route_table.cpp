// SPDX-License-Identifier: Apache-2.0
#include "web/api/route_table.hpp"

#include "web/live/view.hpp"
#include "web_calls.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <stdexcept>
#include <system_error>

namespace obscura::web {
namespace {

using Type = Parameter::Type;

constexpr double max_id = 9e15; ///< that a double holds exactly

constexpr std::string_view text_type = "text/plain; charset=utf-8", json_type = "application/json",
                           exr_type = "image/x-exr",
                           mjpeg_type = "multipart/x-mixed-replace; boundary=picture";

/// The first one is what clients get that name none.
constexpr std::array forms{
    FrameForm{"png", "image/png"},         FrameForm{"fits", "image/fits"},
    FrameForm{"fits", "application/fits"}, FrameForm{"jpg", "image/jpeg"},
    FrameForm{"json", json_type},          FrameForm{"raw", "application/octet-stream"}};

constexpr std::array events_query{
    Parameter{"after", Type::integer, "Only lines with a larger id", false, 0, max_id},
    Parameter{"follow", Type::integer, "0: the lines that are there, as JSON; 1: further ones as they come",
              false, 0, 1}};
constexpr std::array audit_query{
    Parameter{"after", Type::integer, "Only changes with a larger id", false, 0, max_id}};
constexpr Parameter after{
    "after", Type::integer, "Only a frame with a larger id: that of the last answer", false, 0, max_id};
constexpr Parameter wait{"wait", Type::number, "Longest wait for such a frame", false, 0, 30, "s"};
constexpr std::array frame_query{after, wait};
constexpr std::array<std::string_view, 2> reductions{"max", "mean"};
constexpr Parameter view_x{
    "x", Type::integer, "First column of the part that is wanted", false, 0, View::max_side, "px"};
constexpr Parameter view_y{"y", Type::integer, "First row of it", false, 0, View::max_side, "px"};
constexpr Parameter view_w{"w", Type::integer, "Its columns; 0: all further ones", false, 0, View::max_side,
                           "px"};
constexpr Parameter view_h{"h", Type::integer, "Its rows; 0: all further ones", false, 0, View::max_side,
                           "px"};
constexpr Parameter view_bin{"bin", Type::integer, "Columns and rows of which one pixel is made", false,
                             1,     View::max_bin};
constexpr Parameter view_reduce{
    .name = "reduce",
    .type = Type::string,
    .help = "What becomes of the pixels of a bin: their max, which is the default, or their mean",
    .choices = reductions};
constexpr std::array picture_query{view_x, view_y, view_w, view_h, view_bin, view_reduce};
constexpr std::array newest_picture_query{after, wait, view_x, view_y, view_w, view_h, view_bin, view_reduce};
constexpr std::array feature_fields{Parameter{"value", Type::any, "Its value from now on", true}};
constexpr std::array acquisition_fields{
    Parameter{"running", Type::boolean, "Whether the camera acquires from now on", true}};
constexpr Parameter daemon_camera{"camera", Type::string,
                                  "`id` of a camera, whose daemon is meant; missing: the first one"};
constexpr std::array daemon_query{daemon_camera};

/// A name that the table of calls lacks is an error of the build.
constexpr const CallRow& call_row(std::string_view name) {
    for (const CallRow& row : call_rows)
        if (row.name == name) return row;
    throw std::invalid_argument("no such call");
}

constexpr const Parameter& field_of(std::string_view call, std::string_view name) {
    for (const Parameter& field : call_row(call).fields)
        if (field.name == name) return field;
    throw std::invalid_argument("no such field");
}

constexpr Role role_of(std::string_view permission) {
    if (permission == "view") return Role::viewer;
    return permission == "admin" ? Role::admin : Role::control;
}

constexpr std::array force_query{field_of("camera.set", "force")};
constexpr std::array self_test_query{daemon_camera, field_of("self_test", "seconds")};

/// What the route of a call has of its own.
struct Special {
    Answers answers = Answers::call;
    std::string_view help{}, schema{};
    bool own_answer = false;
    /// Query or body, where one is given, stand for the fields of the call.
    std::span<const Parameter> query{};
    std::optional<Body> body{};
    std::span<const Parameter> fields{};
};

/// The route of a call, whose fields are a query of GET, else a body.
constexpr Route route_of(std::string_view method, std::string_view path, std::string_view id,
                         std::string_view call, const Special& special = {}) {
    const CallRow& row = call_row(call);
    const bool changes = method != "GET";
    Route route{special.answers,
                method,
                path,
                id,
                role_of(row.permission),
                special.help.empty() ? row.help : special.help,
                json_type,
                special.schema,
                special.query,
                changes ? special.body.value_or(Body::fields) : Body::none,
                special.fields,
                &row,
                special.own_answer};
    if (special.query.empty() && !special.body) (changes ? route.fields : route.query) = row.fields;
    return route;
}

constexpr std::array all_routes{
    Route{Answers::page,
          "GET",
          "/",
          "page",
          {},
          "The page; its files stand below this path",
          "text/html; charset=utf-8"},
    Route{Answers::alive, "GET", "/livez", "alive", {}, "200 while this process answers", text_type},
    Route{
        Answers::ready, "GET", "/readyz", "ready", Role::viewer,
        "200 if every daemon answers and each camera is on time or idle, with its clock and its files, else 503; "
        "the checks",
        json_type, "Ready"},
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
    Route{Answers::cameras, "GET", "/api/v1/cameras", "cameras", Role::viewer,
          "Cameras of the daemons that answer", json_type, "Cameras"},
    Route{Answers::camera, "GET", "/api/v1/cameras/{camera}", "camera", Role::viewer,
          "What its daemon said last of a camera", json_type, "Camera"},
    route_of("GET", "/api/v1/cameras/{camera}/features", "features", "camera.features",
             {.answers = Answers::features, .schema = "Features"}),
    route_of("PATCH", "/api/v1/cameras/{camera}/features", "features.set", "camera.set",
             {.answers = Answers::set_features,
              .help = "Changes settings: all that are named, or none if one is wrong",
              .schema = "Changed",
              .query = force_query,
              .body = Body::map}),
    route_of("GET", "/api/v1/cameras/{camera}/features/{feature}", "feature", "camera.features",
             {.answers = Answers::feature,
              .help = "One of these settings",
              .schema = "Feature",
              .own_answer = true}),
    route_of("PUT", "/api/v1/cameras/{camera}/features/{feature}", "feature.set", "camera.set",
             {.answers = Answers::set_feature,
              .help = "Changes it; answers with all settings that have changed",
              .schema = "Changed",
              .query = force_query,
              .body = Body::fields,
              .fields = feature_fields}),
    route_of(
        "POST", "/api/v1/cameras/{camera}/trigger", "trigger", "camera.trigger",
        {.answers = Answers::trigger,
         .help =
             "Triggers a frame of a camera whose TriggerSource is Software; 202 if its fate is not known in time",
         .schema = "Trigger"}),
    route_of("POST", "/api/v1/cameras/{camera}/acquisition", "acquisition", "camera.start",
             {.answers = Answers::acquisition,
              .help = "Starts or stops the acquisition",
              .schema = "Acquisition",
              .own_answer = true,
              .body = Body::fields,
              .fields = acquisition_fields}),
    route_of("GET", "/api/v1/cameras/{camera}/timing", "timing", "timing"),
    route_of("GET", "/api/v1/cameras/{camera}/timing/rows", "timing.rows", "timing.rows"),
    route_of("GET", "/api/v1/cameras/{camera}/faults", "faults", "faults.list",
             {.answers = Answers::faults, .schema = "Faults"}),
    route_of("PUT", "/api/v1/cameras/{camera}/faults", "faults.set", "faults.set",
             {.answers = Answers::set_faults, .schema = "Faults"}),
    route_of("GET", "/api/v1/cameras/{camera}/truth", "truth", "truth"),
    route_of("GET", "/api/v1/cameras/{camera}/probe", "probe", "probe", {.answers = Answers::probe}),
    route_of("GET", "/api/v1/cameras/{camera}/scenes", "scenes", "scene.list",
             {.answers = Answers::scenes, .schema = "Scenes"}),
    route_of("PUT", "/api/v1/cameras/{camera}/scene", "scene.show", "scene.show",
             {.answers = Answers::show_scene, .schema = "Shown", .own_answer = true}),
    route_of("GET", "/api/v1/cameras/{camera}/scene", "scene", "scene.describe", {.schema = "Scene"}),
    route_of("GET", "/api/v1/cameras/{camera}/models", "models", "model.list"),
    route_of("PUT", "/api/v1/cameras/{camera}/models", "model.put", "model.put"),
    route_of("GET", "/api/v1/cameras/{camera}/models/text", "model", "model.get"),
    route_of("POST", "/api/v1/cameras/{camera}/models/check", "model.check", "model.check"),
    route_of("POST", "/api/v1/cameras/{camera}/models/plot", "model.plot", "model.plot"),
    route_of("POST", "/api/v1/cameras/{camera}/models/remove", "model.remove", "model.remove"),
    route_of("POST", "/api/v1/cameras/{camera}/pose", "pose", "pose"),
    route_of("POST", "/api/v1/cameras/{camera}/step", "step", "step"),
    route_of("GET", "/api/v1/cameras/{camera}/device", "device", "device.features", {.schema = "Device"}),
    route_of("POST", "/api/v1/cameras/{camera}/device", "device.set", "device.set",
             {.answers = Answers::set_device,
              .help = "Writes one of those features, or runs a command by true: {\"UserSetLoad\": true}",
              .schema = "Written",
              .own_answer = true,
              .body = Body::map}),
    route_of("POST", "/api/v1/cameras/{camera}/release", "release", "release",
             {.answers = Answers::release, .schema = "Released"}),
    route_of("POST", "/api/v1/cameras/{camera}/reload", "reload", "reload"),
    route_of("POST", "/api/v1/cameras/{camera}/log-level", "log_level", "log_level",
             {.answers = Answers::set_log_level}),
    Route{Answers::support_bundle,
          "GET",
          "/api/v1/support-bundle",
          "support-bundle",
          Role::admin,
          "What a maintainer wants to know, as obscura support-bundle saves it: no frames, no tokens",
          "application/zstd",
          {},
          daemon_query},
    route_of("GET", "/api/v1/self-test", "self-test", "self_test",
             {.answers = Answers::self_test, .query = self_test_query}),
    route_of("GET", "/api/v1/cameras/{camera}/configuration", "configuration", "configuration",
             {.answers = Answers::configuration}),
    route_of(
        "PATCH", "/api/v1/cameras/{camera}/configuration", "configuration.set", "configuration.set",
        {.answers = Answers::set_configuration,
         .help =
             "Changes values that a reload can change, given as tables of the file, {\"trigger\": {\"rate_hz\": 20}}: all or none; "
             "the file stays as it is, and the next reload returns to it",
         .schema = "Changed",
         .body = Body::map}),
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
          newest_picture_query},
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
          newest_picture_query},
    Route{Answers::frame_jpeg,
          "GET",
          "/api/v1/cameras/{camera}/frames/latest.jpg",
          "frame.jpg",
          Role::viewer,
          "The newest frame as 8-bit grey JPEG with the contrast of previews, not for measurement; "
          "at most 8192 columns and rows",
          "image/jpeg",
          {},
          newest_picture_query},
    Route{
        Answers::pictures, "GET", "/api/v1/cameras/{camera}/live.mjpg", "live.mjpg", Role::viewer,
        "Pictures of at most 512 pixels a side, at most 5 a second, as JPEG with the contrast of previews, for players; "
        "the token may also be the password of the scheme Basic",
        mjpeg_type},
    Route{Answers::pictures, "GET", "/live.mjpg", "live.mjpg.first", Role::viewer,
          "The same of the first camera", mjpeg_type},
    Route{Answers::frame_json, "GET", "/api/v1/cameras/{camera}/frames/{frame}.json", "frame.id.json",
          Role::viewer, "What is known of a frame that a viewer sees, or has just seen", json_type, "Frame"},
    Route{Answers::frame_png,
          "GET",
          "/api/v1/cameras/{camera}/frames/{frame}.png",
          "frame.id.png",
          Role::viewer,
          "That frame, 16 bits a pixel, digital numbers as they are",
          "image/png",
          {},
          picture_query},
    Route{Answers::frame_fits, "GET", "/api/v1/cameras/{camera}/frames/{frame}.fits", "frame.id.fits",
          Role::viewer, "That frame with its metadata", "image/fits"},
    Route{Answers::frame_raw,
          "GET",
          "/api/v1/cameras/{camera}/frames/{frame}.raw",
          "frame.id.raw",
          Role::viewer,
          "That frame as little-endian numbers of 16 bits, row by row",
          "application/octet-stream",
          {},
          picture_query},
    Route{Answers::frame_jpeg,
          "GET",
          "/api/v1/cameras/{camera}/frames/{frame}.jpg",
          "frame.id.jpg",
          Role::viewer,
          "That frame as 8-bit grey JPEG, as above",
          "image/jpeg",
          {},
          picture_query},
    Route{
        Answers::frame_exr, "GET", "/api/v1/cameras/{camera}/frames/latest.exr", "frame.exr", Role::viewer,
        "Irradiance of the newest frame, W/m2 at the entrance pupil, one channel a spectral band: rendered again without a detector, one frame at a time, which takes seconds",
        exr_type},
    Route{Answers::frame_exr, "GET", "/api/v1/cameras/{camera}/frames/{frame}.exr", "frame.id.exr",
          Role::viewer, "The same of that frame, while its daemon keeps it: one of the newest four",
          exr_type},
    Route{Answers::frame,
          "GET",
          "/api/v1/cameras/{camera}/frames/latest",
          "frame",
          Role::viewer,
          "The newest frame in the form that the header Accept names, 406 if that is none; without it as PNG",
          "image/png",
          {},
          frame_query},
    Route{Answers::frame, "GET", "/api/v1/cameras/{camera}/frames/{frame}", "frame.id", Role::viewer,
          "That frame in the form that the header Accept names", "image/png"},
};

/// Whether a path is of that pattern; what stands for its names goes to `found`.
bool is_of(std::string_view path, std::string_view pattern, Match& found) {
    std::string_view camera, feature;
    std::optional<std::uint64_t> frame;
    while (true) {
        const std::size_t at = pattern.find('{');
        if (path.substr(0, at) != pattern.substr(0, at)) return false;
        if (at == std::string_view::npos) break;
        path.remove_prefix(at);
        pattern.remove_prefix(at);
        const std::string_view name = pattern.substr(0, pattern.find('}') + 1);
        std::size_t size = std::min(path.find('/'), path.size());
        if (name == "{frame}") {
            std::uint64_t number = 0;
            const auto [end, error] = std::from_chars(path.data(), path.data() + size, number);
            if (error != std::errc{}) return false;
            size = static_cast<std::size_t>(end - path.data());
            frame = number;
        } else {
            (name == "{feature}" ? feature : camera) = path.substr(0, size);
        }
        if (size == 0) return false;
        path.remove_prefix(size);
        pattern.remove_prefix(name.size());
    }
    found.camera = camera;
    found.feature = feature;
    found.frame = frame;
    return true;
}

} // namespace

std::span<const FrameForm> frame_forms() {
    return forms;
}

std::span<const Route> routes() {
    return all_routes;
}

Match match(std::string_view method, std::string_view path) {
    Match found;
    const std::string_view wanted = method == "HEAD" ? "GET" : method;
    for (const Route& route : all_routes) {
        if (!is_of(path, route.path, found)) continue;
        found.methods.push_back(route.method);
        if (route.method == wanted) found.route = &route;
    }
    return found;
}

} // namespace obscura::web
