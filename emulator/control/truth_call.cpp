// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/truth_call.hpp"

#include "transports/watch/watch.hpp"

#include <fmt/format.h>

#include <chrono>
#include <optional>
#include <utility>

namespace obscura::emulator {
namespace {

using nlohmann::json;
using service::Answer;
using service::Failure;
using service::FailureCode;
using service::Fields;
using service::Work;

struct Arguments {
    std::uint32_t camera = 0;
    double wait_s = 2;

    Fields fields() {
        return {{config::key("camera", &camera)
                     .range(0, 1000)
                     .help("Number of the camera, in the order of the configuration"),
                 config::key("wait_s", &wait_s)
                     .unit("s")
                     .range(0, 60)
                     .help("Longest wait for a frame where none was looked at")}};
    }
};

json json_of(const Vec3& v) {
    return {v.x, v.y, v.z};
}

/// null where there is none.
json json_of(const std::optional<double>& value) {
    return value ? json(*value) : json();
}

Answer truth(const CameraCalls::Cameras& cameras, const PositionsOf& positions, const Arguments& arguments,
             const Work& work) {
    transports::WatchTransport* const watch = checked_camera(cameras, arguments.camera).watch;
    if (watch == nullptr) throw Failure(FailureCode::not_now, "truth: the daemon keeps no frames for calls");
    const auto until = std::chrono::steady_clock::now() +
                       std::chrono::microseconds(static_cast<std::int64_t>(arguments.wait_s * 1e6));
    const std::optional<FrameInfo> frame = watch->newest_info(until, work.cancelled());
    if (work.cancelled()) throw service::cancelled();
    if (!frame)
        throw Failure(FailureCode::not_now, fmt::format("truth: no frame came in {} s", arguments.wait_s));
    const GroundTruth& there = frame->truth;
    json bodies = json::array();
    for (const BodyPosition& body : positions(arguments.camera, *frame))
        bodies.push_back({{"name", body.name},
                          {"x", json_of(body.x_px)},
                          {"y", json_of(body.y_px)},
                          {"radius_px", json_of(body.radius_px)},
                          {"range_m", body.range_m},
                          {"position_m", json_of(body.position_m)}});
    const Quat& q = there.camera.orientation;
    return {{{"frame", frame->frame_id},
             {"mid_exposure_tai_ns", there.mid_exposure.ns + frame->tai_offset_ns},
             {"camera_position_m", json_of(there.camera.position_m)},
             {"camera_orientation", {q.w, q.x, q.y, q.z}},
             {"sun_position_m", json_of(there.sun_position_m)},
             {"bodies", std::move(bodies)}}};
}

} // namespace

service::Call truth_call(const CameraCalls::Cameras& cameras, PositionsOf positions) {
    service::Call call = service::call<Arguments>(
        "truth", service::Permission::view,
        "Tells where bodies are in the newest frame of the camera: of their true poses at mid-exposure, "
        "projected "
        "by the lens of the scene that is shown. Rows of a rolling shutter are exposed at other times.",
        [&cameras, positions = std::move(positions)](const Arguments& arguments, Work& work) {
            return truth(cameras, positions, arguments, work);
        });
    call.results = {
        {"frame", "integer", "", "Number of the frame in its acquisition"},
        {"mid_exposure_tai_ns", "integer", "ns", "Middle of the exposure, TAI, for which all of it holds"},
        {"camera_position_m", "array of 3 numbers", "m", "Inertial"},
        {"camera_orientation", "array of 4 numbers", "",
         "Quaternion w, x, y, z: from camera to inertial axes"},
        {"sun_position_m", "array of 3 numbers", "m", "Inertial"},
        {"bodies", "array of maps", "",
         "name; x and y of the origin in the image, px, pixel centres at integers, null where the lens shows "
         "none; "
         "radius_px of the bounding sphere, null within it; range_m; position_m, inertial. At most 16"}};
    return call;
}

} // namespace obscura::emulator
