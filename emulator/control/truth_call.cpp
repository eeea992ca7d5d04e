// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/truth_call.hpp"

#include "core/camera/camera.hpp"
#include "core/error.hpp"
#include "emulator/camera/frame_overlays.hpp"
#include "transports/watch/watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <thread>
#include <utility>

namespace obscura::emulator {
namespace {

using nlohmann::json;
using service::Answer;
using service::Failure;
using service::FailureCode;
using service::Fields;
using service::Work;
using transports::KeptFrame;

/// Interval at which the call checks for the frame that it waits for.
constexpr std::int64_t poll_interval_ns = 100 * ns_per_ms;

struct TruthArguments {
    std::uint32_t camera = 0;
    std::uint64_t frame = 0;
    double wait_s = 2;

    Fields fields() {
        return {{config::key("camera", &camera)
                     .range(0, 1000)
                     .help("Number of the camera, in the order of the configuration"),
                 config::key("frame", &frame)
                     .range(0, 9e15)
                     .help("Number of the frame, one of the latest that were looked at; 0: the newest"),
                 config::key("wait_s", &wait_s)
                     .unit("s")
                     .range(0, max_frame_wait_s)
                     .help("Longest wait for a frame where none was looked at")}};
    }
};

json truth_json(const Vec3& v) {
    return {v.x, v.y, v.z};
}

/// null where there is none.
json truth_json(const std::optional<double>& value) {
    return value ? json(*value) : json();
}

/// Rounds to a ten thousandth of a pixel, which shortens curves of many points.
double rounded(double px) {
    return std::round(px * 1e4) / 1e4;
}

json point_of(const renderer::ImagePoint& point) {
    return {{"x", rounded(point.x)}, {"y", rounded(point.y)}};
}

json truth_json(const renderer::OverlayBody& body) {
    json limb = json::array(), lit = json::array();
    for (const renderer::LimbPoint& point : body.limb) {
        if (point.begins && !limb.empty()) {
            limb.push_back(nullptr);
            lit.push_back(nullptr);
        }
        limb.push_back({rounded(point.at.x), rounded(point.at.y)});
        lit.push_back(point.lit);
    }
    json told{{"name", body.name},
              {"x", truth_json(body.at ? std::optional(body.at->x) : std::nullopt)},
              {"y", truth_json(body.at ? std::optional(body.at->y) : std::nullopt)},
              {"radius_px", truth_json(body.radius_px)},
              {"range_m", body.range_m},
              {"position_m", truth_json(body.position_m)},
              {"limb", std::move(limb)},
              {"limb_lit", std::move(lit)}};
    if (body.motion)
        told["motion"] = {{"start", point_of(body.motion->start)}, {"end", point_of(body.motion->end)}};
    return told;
}

json truth_json(const renderer::OverlayStar& star) {
    json told = point_of(star.at);
    told["name"] = star.name.empty() ? json() : json(star.name);
    told["magnitude"] = std::round(star.magnitude_v * 1e3) / 1e3;
    return told;
}

template<class T>
json list_of(const std::vector<T>& values) {
    json list = json::array();
    for (const T& value : values)
        list.push_back(truth_json(value));
    return list;
}

json truth_windows(const FrameInfo& frame) {
    json list = json::array();
    for (std::uint32_t w = 0; w < std::min<std::size_t>(frame.window_count, max_windows); ++w) {
        const FrameWindow& window = frame.windows[w];
        list.push_back({{"name", fmt::format("window {}", w)},
                        {"x", 0},
                        {"y", window.image_y},
                        {"w", window.sensor.width},
                        {"h", window.sensor.height},
                        {"sensor_x", window.sensor.x},
                        {"sensor_y", window.sensor.y}});
    }
    return list;
}

json hot_pixels_of(const std::vector<PixelPlace>& pixels) {
    json list = json::array();
    for (const PixelPlace& pixel : pixels)
        list.push_back({pixel.x, pixel.y});
    return list;
}

struct Told {
    KeptFrame frame;
    std::shared_ptr<const FrameOverlay> overlay;
};

/// The frame that is asked for, with its overlay. Throws Failure.
Told told_of(const ControlledCamera& camera, const TruthArguments& arguments, const Work& work) {
    if (camera.watch == nullptr || !camera.overlay)
        throw Failure(FailureCode::not_now, "truth: the daemon keeps no frames for calls");
    camera.watch->look(poll_interval_ns);
    const auto until = std::chrono::steady_clock::now() +
                       std::chrono::microseconds(static_cast<std::int64_t>(arguments.wait_s * 1e6));
    while (true) {
        const auto frame = camera.watch->kept(arguments.frame, until, work.cancelled());
        if (work.cancelled()) throw service::cancelled();
        if (arguments.frame > 0 && (!frame || frame->info.frame_id != arguments.frame))
            throw Failure(
                FailureCode::not_now,
                fmt::format("truth: frame {} is not one of the latest that were looked at", arguments.frame));
        if (!frame)
            throw Failure(FailureCode::not_now,
                          fmt::format("truth: no frame came in {} s", arguments.wait_s));
        if (auto overlay = camera.overlay(*frame)) return {*frame, std::move(overlay)};
        // The first frame of another scene is on its way when that of the newest one has gone.
        if (arguments.frame > 0 || std::chrono::steady_clock::now() >= until)
            throw Failure(
                FailureCode::not_now,
                fmt::format("truth: frame {} is of a scene that has been replaced", frame->info.frame_id));
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
}

Answer truth(const ControlledCamera& camera, const TruthArguments& arguments, const Work& work) {
    const auto [frame, overlay] = told_of(camera, arguments, work);
    const FrameInfo& info = frame.info;
    const GroundTruth& there = info.truth;
    const Quat& q = there.camera.orientation;
    return {{{"frame", info.frame_id},
             {"mid_exposure_tai_ns", there.mid_exposure.ns + info.tai_offset_ns},
             {"camera_position_m", truth_json(there.camera.position_m)},
             {"camera_orientation", {q.w, q.x, q.y, q.z}},
             {"sun_position_m", truth_json(there.sun_position_m)},
             {"bodies", list_of(overlay->seen.bodies)},
             {"bodies_of", overlay->seen.bodies_of},
             {"stars", list_of(overlay->seen.stars)},
             {"windows", truth_windows(info)},
             {"hot_pixels", hot_pixels_of(overlay->hot_pixels)}}};
}

} // namespace

service::Call truth_call(const CameraCalls::Cameras& cameras) {
    service::Call call = service::call<TruthArguments>(
        "truth", service::Permission::view,
        "Tells where things are in a frame of the camera, of its own poses and its own scene, px of the image with pixel centres at integers: where their light lands, each row of a rolling shutter at its own time, as in the truth table (docs/truth.md).",
        [&cameras](const TruthArguments& arguments, Work& work) {
            return truth(checked_camera(cameras, arguments.camera), arguments, work);
        });
    call.results = {
        {"frame", "integer", "", "Number of the frame in its acquisition"},
        {"mid_exposure_tai_ns", "integer", "ns", "Middle of the exposure, TAI"},
        {"camera_position_m", "array of 3 numbers", "m", "Inertial, at mid-exposure"},
        {"camera_orientation", "array of 4 numbers", "",
         "Quaternion w, x, y, z: from camera to inertial axes, at mid-exposure"},
        {"sun_position_m", "array of 3 numbers", "m", "Inertial, at mid-exposure"},
        {"bodies", "array of maps", "",
         "name; x and y of the origin, null where the lens shows none; "
         "radius_px of the bounding sphere, null within it; range_m; position_m, inertial; "
         "limb, points [x, y] where it is seen, at most 64 in each window, null between parts, the first point again at the end of a closed one; "
         "limb_lit of each, whether the Sun shines there; "
         "motion {start, end}, of the origin from the first to the last row, if it is more than half a pixel. "
         "At most 64"},
        {"bodies_of", "integer", "", "Bodies of the scene"},
        {"stars", "array of maps", "",
         "x, y, name (null where none is known) and magnitude (V) of the brightest that are seen, at most 100"},
        {"windows", "array of maps", "",
         "name; x, y, w and h in the image; sensor_x and sensor_y of its first pixel"},
        {"hot_pixels", "array of arrays", "px",
         "[x, y] of the hottest, at most 256: stuck at high digital numbers, or ten times the mean dark current"}};
    return call;
}

} // namespace obscura::emulator
