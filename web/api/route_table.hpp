// SPDX-License-Identifier: Apache-2.0
// Table of routes, of which router, OpenAPI document and reference page are made.
#pragma once

#include "web/api/call_rows.hpp"
#include "web/server/access.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

namespace obscura::web {

/// What a route answers; Routes and CameraJobs have a function for each.
enum class Answers : std::uint8_t {
    call, ///< what the daemon answers to Route::call
    page,
    alive,
    ready,
    metrics,
    state,
    events,
    me,
    audit,
    openapi,
    cameras,
    camera,
    features,
    set_features,
    feature,
    set_feature,
    trigger,
    acquisition,
    faults,
    set_faults,
    probe,
    scenes,
    show_scene,
    configuration,
    set_configuration,
    set_device,
    release,
    set_log_level,
    support_bundle,
    self_test,
    frame_png,
    frame_fits,
    frame_raw,
    frame_jpeg,
    frame_json,
    frame_exr,
    frame,    ///< in the form that the client takes
    pictures, ///< of the camera, or of the first one
};

/// What the body of a request holds.
enum class Body : std::uint8_t {
    none,
    fields, ///< an object of Route::fields
    map,    ///< an object of any names
};

/// One row of the table.
struct Route {
    Answers answers;
    std::string_view method; ///< HEAD goes where GET goes
    /// "{camera}" stands for the id of a camera, or its number where one daemon runs, "{feature}" for a name
    /// of SFNC, "{frame}" for the id of a frame, digits.
    std::string_view path;
    std::string_view id;      ///< of the operation, also in the record of changes
    std::optional<Role> role; ///< none: open to all
    std::string_view help;
    std::string_view type; ///< of the answer
    std::string_view
        schema{}; ///< of the answer, a component of the document; empty: named as the call, or none
    std::span<const Parameter> query{};
    Body body = Body::none;
    std::span<const Parameter> fields{};
    /// Call of the daemon that the route makes; null: none. Role, help and fields are those of the call where
    /// the table says nothing else.
    const CallRow* call = nullptr;
    bool own_answer = false; ///< another one than the call's

    [[nodiscard]] bool changes() const { return method != "GET"; }
    [[nodiscard]] bool is_api() const { return path.starts_with("/api/"); }
};
[[nodiscard]] std::span<const Route> routes();

/// A form in which a frame can be had.
struct FrameForm {
    std::string_view suffix, type; ///< of the media type
};
/// For Answers::frame.
[[nodiscard]] std::span<const FrameForm> frame_forms();

/// Where a request goes.
struct Match {
    const Route* route = nullptr;          ///< null: no row has path and method
    std::string_view camera, feature;      ///< what stands for "{camera}", "{feature}"
    std::optional<std::uint64_t> frame;    ///< what stands for "{frame}"
    std::vector<std::string_view> methods; ///< that the path has; empty: there is no such path
};
[[nodiscard]] Match match(std::string_view method, std::string_view path);

} // namespace obscura::web
