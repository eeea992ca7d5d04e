// SPDX-License-Identifier: Apache-2.0
#include "web/api/route_table.hpp"

#include "web/live/view.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <system_error>

namespace obscura::web {
namespace {

using Type = Parameter::Type;

constexpr double most_id = 9e15; ///< that a double holds exactly

constexpr std::string_view text_type = "text/plain; charset=utf-8", json_type = "application/json",
                           exr_type = "image/x-exr",
                           mjpeg_type = "multipart/x-mixed-replace; boundary=picture";

/// The first one is what clients get that name none.
constexpr std::array forms{
    FrameForm{"png", "image/png"},         FrameForm{"fits", "image/fits"},
    FrameForm{"fits", "application/fits"}, FrameForm{"jpg", "image/jpeg"},
    FrameForm{"json", json_type},          FrameForm{"raw", "application/octet-stream"}};

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
    Parameter{"most", Type::integer, "Largest number of rows", false, 1, 1024}};
constexpr std::array timing_rows_query{Parameter{
    "frame", Type::integer, "Number of a frame, one of the newest 1024; 0: the newest", false, 0, most_id}};
constexpr std::array probe_query{
    Parameter{"x", Type::integer, "Column of the image", true, 0, 65535, "px"},
    Parameter{"y", Type::integer, "Row of the image", true, 0, 65535, "px"},
    Parameter{"frame", Type::integer,
              "Number of a frame, one of the newest; 0: the newest, which is the default", false, 0,
              most_id}};
constexpr Parameter after{
    "after", Type::integer, "Only a frame with a larger id: that of the last answer", false, 0, most_id};
constexpr Parameter wait{"wait", Type::number, "Longest wait for such a frame", false, 0, 30, "s"};
constexpr std::array frame_query{after, wait};
constexpr std::array<std::string_view, 2> reductions{"max", "mean"};
constexpr Parameter view_x{
    "x", Type::integer, "First column of the part that is wanted", false, 0, View::most_side, "px"};
constexpr Parameter view_y{"y", Type::integer, "First row of it", false, 0, View::most_side, "px"};
constexpr Parameter view_w{"w", Type::integer, "Its columns; 0: all further ones", false, 0, View::most_side,
                           "px"};
constexpr Parameter view_h{"h", Type::integer, "Its rows; 0: all further ones", false, 0, View::most_side,
                           "px"};
constexpr Parameter view_bin{"bin", Type::integer, "Columns and rows of which one pixel is made", false,
                             1,     View::most_bin};
constexpr Parameter view_reduce{
    .name = "reduce",
    .type = Type::string,
    .help = "What becomes of the pixels of a bin: their max, which is the default, or their mean",
    .choices = reductions};
constexpr std::array picture_query{view_x, view_y, view_w, view_h, view_bin, view_reduce};
constexpr std::array newest_picture_query{after, wait, view_x, view_y, view_w, view_h, view_bin, view_reduce};
constexpr std::array truth_query{Parameter{
    "frame", Type::integer, "Frame of that number, one of the latest that were looked at; 0: the newest",
    false, 0, most_id}};
constexpr std::array feature_fields{Parameter{"value", Type::any, "Its value from now on", true}};
constexpr std::array trigger_fields{
    Parameter{"wait", Type::boolean, "Answer when the fate of the frame is known, which is the default"}};
constexpr std::array acquisition_fields{
    Parameter{"running", Type::boolean, "Whether the camera acquires from now on", true}};
constexpr std::array fault_fields{Parameter{
    "rules", Type::array, "Rules as GET has them, instead of those that are armed; none: disarm", true}};
constexpr std::array scene_fields{
    Parameter{"file", Type::string, "Name of a shipped scene, or of a file below control.scenes", true}};

constexpr std::array pose_fields{
    Parameter{"name", Type::string, "Body or lamp of the scene, or \"camera\"", true},
    Parameter{"time_s", Type::number, "Scene time of the pose, later than that of the one before", true, 0,
              999'999'999, "s"},
    Parameter{"position_m", Type::array, "Position x, y, z, inertial or in the parent's frame, m", true},
    Parameter{"orientation", Type::array, "Quaternion w, x, y, z; missing: that of the frame"}};
constexpr std::array step_fields{Parameter{"time_s", Type::number,
                                           "Scene time of the frame, later than that of the step before",
                                           true, 0, 999'999'999, "s"}};
constexpr std::array level_fields{
    Parameter{"level", Type::string, "error, warning, notice, info or debug", true}};
constexpr std::array daemon_query{
    Parameter{"camera", Type::string, "`id` of a camera, whose daemon is meant; missing: the first one"}};

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
          "200 if every daemon answers and each camera is on time or idle, with its clock and its files, "
          "else 503; the checks",
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
    Route{Answers::features, "GET", "/api/v1/cameras/{camera}/features", "features", Role::viewer,
          "Settings of a camera by their SFNC names", json_type, "Features"},
    Route{Answers::set_features, "PATCH", "/api/v1/cameras/{camera}/features", "features.set", Role::control,
          "Changes settings: all that are named, or none if one is wrong", json_type, "Changed", force_query,
          Body::map},
    Route{Answers::feature, "GET", "/api/v1/cameras/{camera}/features/{feature}", "feature", Role::viewer,
          "One of these settings", json_type, "Feature"},
    Route{Answers::set_feature, "PUT", "/api/v1/cameras/{camera}/features/{feature}", "feature.set",
          Role::control, "Changes it; answers with all settings that have changed", json_type, "Changed",
          force_query, Body::fields, feature_fields},
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
    Route{Answers::timing_rows, "GET", "/api/v1/cameras/{camera}/timing/rows", "timing.rows", Role::viewer,
          "How late each row of a frame left", json_type, "TimingRows", timing_rows_query},
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
          "Where bodies, limbs, stars, windows and hot pixels are in a frame", json_type, "Truth",
          truth_query},
    Route{Answers::probe, "GET", "/api/v1/cameras/{camera}/probe", "probe", Role::viewer,
          "One pixel of a frame: digital number, electrons, irradiance, and what it shows", json_type,
          "Probe", probe_query},
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
    Route{Answers::scene, "GET", "/api/v1/cameras/{camera}/scene", "scene", Role::viewer,
          "The scene that is shown: its bodies, and where their poses come from", json_type, "Scene"},
    Route{Answers::pose,
          "POST",
          "/api/v1/cameras/{camera}/pose",
          "pose",
          Role::control,
          "Moves the camera, a body or a lamp; needs simulator.enabled",
          json_type,
          {},
          {},
          Body::fields,
          pose_fields},
    Route{Answers::step,
          "POST",
          "/api/v1/cameras/{camera}/step",
          "step",
          Role::control,
          "Makes the frame of a scene time in lockstep; answers when its last row has left",
          json_type,
          "Step",
          {},
          Body::fields,
          step_fields},
    Route{Answers::device, "GET", "/api/v1/cameras/{camera}/device", "device", Role::viewer,
          "Features of the GigE Vision side with the values that its client reads", json_type, "Device"},
    Route{Answers::set_device,
          "POST",
          "/api/v1/cameras/{camera}/device",
          "device.set",
          Role::control,
          "Writes one of those features, or runs a command by true: {\"UserSetLoad\": true}",
          json_type,
          "Written",
          {},
          Body::map},
    Route{Answers::release,
          "POST",
          "/api/v1/cameras/{camera}/release",
          "release",
          Role::admin,
          "Takes control away from the GigE Vision client that has it",
          json_type,
          "Released",
          {},
          Body::fields},
    Route{Answers::reload,
          "POST",
          "/api/v1/cameras/{camera}/reload",
          "reload",
          Role::admin,
          "Has the daemon read its configuration again, as SIGHUP does; all changes are taken on, or none",
          json_type,
          {},
          {},
          Body::fields},
    Route{Answers::set_log_level,
          "POST",
          "/api/v1/cameras/{camera}/log-level",
          "log_level",
          Role::control,
          "Changes how much the daemon logs, until the next reload",
          json_type,
          "LogLevel",
          {},
          Body::fields,
          level_fields},
    Route{Answers::support_bundle,
          "GET",
          "/api/v1/support-bundle",
          "support-bundle",
          Role::admin,
          "What a maintainer wants to know, as obscura support-bundle saves it: no frames, no tokens",
          "application/zstd",
          {},
          daemon_query},
    Route{Answers::self_test, "GET", "/api/v1/self-test", "self-test", Role::control,
          "Measures for 0.6 s how late an ordinary thread of this machine releases rows", json_type,
          "SelfTest", daemon_query},
    Route{Answers::configuration, "GET", "/api/v1/cameras/{camera}/configuration", "configuration",
          Role::viewer, "Every key of the configuration, its value and where that comes from", json_type,
          "Configuration"},
    Route{Answers::set_configuration,
          "PATCH",
          "/api/v1/cameras/{camera}/configuration",
          "configuration.set",
          Role::admin,
          "Changes values that a reload can change, given as tables of the file, {\"trigger\": {\"rate_hz\": "
          "20}}: all or none; the file stays as it is, and the next reload returns to it",
          json_type,
          "Changed",
          {},
          Body::map},
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
          "The newest frame as 8-bit grey JPEG with the contrast of previews, not for measurement; at most "
          "8192 columns and rows",
          "image/jpeg",
          {},
          newest_picture_query},
    Route{Answers::pictures, "GET", "/api/v1/cameras/{camera}/live.mjpg", "live.mjpg", Role::viewer,
          "Pictures of at most 512 pixels a side, at most 5 a second, as JPEG with the contrast of previews, "
          "for players; the "
          "token may also be the password of the scheme Basic",
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
    Route{Answers::frame_exr, "GET", "/api/v1/cameras/{camera}/frames/latest.exr", "frame.exr", Role::viewer,
          "Irradiance of the newest frame, W/m2 at the entrance pupil, one channel a spectral band: rendered "
          "again without a detector, one frame at a time, which takes seconds",
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
