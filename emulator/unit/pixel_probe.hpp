// SPDX-License-Identifier: Apache-2.0
// Pixel probe: light, expected electrons and geometry of one pixel of a frame, by rendering it again.
#pragma once

#include "core/camera/frame.hpp"
#include "core/time.hpp"
#include "emulator/camera/frame_origins.hpp"
#include "emulator/render/frame_light.hpp"
#include "renderer/renderer.hpp"
#include "sensors/sensor.hpp"

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace obscura::emulator {

struct DaemonConfig;
class ShiftedPose;

/// What a camera renders and exposes with, besides its scene.
struct ProbeSettings {
    renderer::RenderSettings render; ///< one thread, without hooks
    SensorDescription sensor;
    std::uint64_t seed = 1;
};
/// Probe settings of a camera.
[[nodiscard]] ProbeSettings probe_settings(const DaemonConfig& config);

/// A frame as the probe needs it.
struct ProbedFrame {
    const FrameInfo& info;
    const std::vector<RowTime>& row_times; ///< of all rows, scheduling clock
    FrameOrigin origin;
};

/// Answer of the probe. Angles in degrees; none where no body is, or the Sun itself.
struct ProbedPixel {
    /// Middle of the exposure of the pixel's row, or of the pixel where it has a time of its own; scheduling
    /// clock.
    Time row_mid;
    std::vector<double> irradiance_w_m2{}; ///< at the entrance pupil, of each spectral band
    std::optional<double> samples{};       ///< rays of the pixel; none: of a push-broom sensor
    /// Expected electrons, as PixelTruth has them; none: the effects of the detector need other pixels.
    std::optional<double> mean_e{};
    /// On the ray through the pixel's centre; none: nothing is there.
    std::optional<std::string> body{};
    std::optional<double> range_m{};
    std::optional<double> latitude_deg{}, longitude_deg{}; ///< planetocentric, of the body's own axes
    std::optional<double> incidence_deg{}, emission_deg{}, phase_deg{};
};

/// The window that has a pixel of the composed image; none: the pixel is right of a narrow window.
[[nodiscard]] std::optional<std::size_t> window_of(const FrameInfo& frame, std::int32_t x, std::int32_t y);

/// A renderer of one thread and a detector of its own, so that it shares nothing with the threads that make
/// frames. At full quality, with the samples that the frame would have: of a frame whose rows are at
/// QualityLevel::full the same light, bit for bit. Thread-bound.
class PixelProbe {
public:
    /// Builds the scene once more. Throws Error.
    PixelProbe(std::shared_ptr<const scene::Scene> scene, const ProbeSettings& settings);
    ~PixelProbe();

    /// Which scene it has.
    [[nodiscard]] const scene::Scene* scene() const noexcept { return scene_.get(); }

    /// Probes a pixel that a window has, of a frame of that scene. Throws service::Failure: cancelled, or
    /// not-now if the poses of a live scene are not known any more.
    [[nodiscard]] ProbedPixel probe(const ProbedFrame& frame, std::int32_t x, std::int32_t y,
                                    const std::atomic<bool>& cancel);
    /// Irradiance at the entrance pupil of all pixels of a frame of that scene, W/m2: bands x height x width,
    /// 0 beside narrow windows. Throws as probe().
    [[nodiscard]] std::vector<float> irradiance(const ProbedFrame& frame, const std::atomic<bool>& cancel);

private:
    struct Place;
    struct Light;

    void attach_shifts(scene::Scene& scene);
    void take_poses_of(const ProbedFrame& frame);
    [[nodiscard]] FrameLight light_of(const ProbedFrame& frame) const;
    [[nodiscard]] Place place_of(const ProbedFrame& frame, std::int32_t x, std::int32_t y) const;
    /// The plan of the frame, with the times that it has; nothing: it cannot be planned now.
    [[nodiscard]] std::optional<sensors::ReadoutPlan> plan_of(const ProbedFrame& frame) const;
    [[nodiscard]] std::optional<double> mean_electrons(const ProbedFrame& frame, const Place& place,
                                                       const Light& light) const;
    /// Returns as Renderer::render().
    [[nodiscard]] bool tell_surface(const Place& place, const std::atomic<bool>& cancel,
                                    ProbedPixel& pixel) const;

    const std::shared_ptr<const scene::Scene> scene_;
    const ReadoutSettings readout_;
    std::shared_ptr<ShiftedPose> camera_shift_;             ///< null: not live
    std::vector<std::shared_ptr<ShiftedPose>> body_shifts_; ///< of each body; null: not live
    bool live_ = false;
    std::unique_ptr<renderer::Renderer> renderer_;
    std::unique_ptr<sensors::Detector> detector_;
    std::int32_t lines_; ///< rows that a pixel needs, with the halo
    std::unique_ptr<renderer::Workspace> workspace_;
    BlockRenderer blocks_;
};

} // namespace obscura::emulator
