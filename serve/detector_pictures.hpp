// SPDX-License-Identifier: Apache-2.0
// Pictures of a client's scene in digital numbers: sensors that clients name, and their detectors.
#pragma once

#include "core/camera/frame.hpp"
#include "renderer/renderer.hpp"
#include "sensors/sensor.hpp"
#include "serve/scene_calls.hpp"
#include "service/call.hpp"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace obscura::serve {

/// One exposure, as the first frame of an acquisition: no charge of earlier frames is left.
struct ExposureRequest {
    Time trigger; ///< scene time at which the first row begins to integrate
    std::int64_t exposure_ns = 0;
    double gain_db = 0;
    std::optional<Region> window; ///< none: the whole array
    std::uint64_t seed = 1, frame = 1;
    std::uint32_t run = 0;
};

/// An exposed frame and the times of its rows.
struct ExposedFrame {
    std::unique_ptr<FramePool> pool;
    FrameRef frame; ///< of the pool
    std::vector<RowTime> rows;

    [[nodiscard]] Time mid() const { return midpoint(rows.front().reset, rows.back().read); }
};

/// Detector of one client, kept for as long as sensor, scene and seed stay the same. Thread-bound.
class DetectorPictures {
public:
    /// `scene` outlives this.
    explicit DetectorPictures(const SceneCalls& scene) : scene_(scene) {}

    /// The sensor that the field of a request gives: a shipped one or a file below the server's folder by its
    /// name, or a map of the keys of [sensor]. Valid until the next call. Throws Failure.
    const SensorDescription& read(const nlohmann::json& field);
    /// The sensor read last.
    [[nodiscard]] const SensorDescription& sensor() const { return sensor_; }
    /// Exposes it, through a renderer whose camera has its pixels and whose scene has its response
    /// (renderer::set_detector_response). The same bytes as
    /// `obscura capture` makes of a first frame. Throws Failure.
    [[nodiscard]] ExposedFrame expose(const renderer::Renderer& renderer, const ExposureRequest& request,
                                      service::Work& work);

private:
    struct Made {
        std::uint64_t revision = 0, seed = 0;
        sensors::Detector detector;
    };

    [[nodiscard]] sensors::Detector& detector(const renderer::Renderer& renderer, std::uint64_t seed);

    const SceneCalls& scene_;
    nlohmann::json field_; ///< that sensor_ was read from
    SensorDescription sensor_;
    std::unique_ptr<Made> made_;
};

} // namespace obscura::serve
