// SPDX-License-Identifier: Apache-2.0
// Overlays of frames: bodies, limbs, stars with their names, and hot pixels in the image.
#pragma once

#include "emulator/camera/frame_origins.hpp"
#include "ephemeris/stars/star_names.hpp"
#include "renderer/renderer.hpp"
#include "renderer/truth/overlay.hpp"
#include "sensors/sensor.hpp"
#include "transports/watch/watch.hpp"

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

namespace obscura::emulator {

/// Scene of a frame: the renderer that made it, and at which times.
struct FrameScene {
    std::shared_ptr<const renderer::Renderer> renderer;
    FrameOrigin origin;

    /// Time of the scene at a time of the scheduling clock.
    [[nodiscard]] Time at(Time clock) const noexcept { return origin.shown.at(origin.planned(clock)); }
};

/// A pixel, of the sensor or of the image.
struct PixelPlace {
    std::int32_t x = 0, y = 0;

    constexpr bool operator==(const PixelPlace&) const = default;
};

/// Overlay of one frame.
struct FrameOverlay {
    renderer::Overlay seen;             ///< stars of catalogues have names, where they are known
    std::vector<PixelPlace> hot_pixels; ///< in the image, the hottest first
};

/// Hot pixels of a sensor, the hottest first, at most `most`: stuck at the upper half of the digital numbers,
/// then those with at least ten times the mean dark current.
[[nodiscard]] std::vector<PixelPlace> hot_pixels(const sensors::FixedPattern& pattern,
                                                 const DetectorSettings& settings, std::size_t most);

/// Overlays of the frames of one camera. Thread-safe; the frame asked for last is made once, however many
/// ask.
class FrameOverlays {
public:
    /// `detector`, which outlives it, has that aperture now.
    FrameOverlays(SensorDescription sensor, const sensors::Detector& detector, double aperture_m)
        : sensor_(std::move(sensor)),
          detector_(detector),
          aperture_m_(aperture_m),
          electrons_(detector.electrons_per_s_per_w_m2().begin(), detector.electrons_per_s_per_w_m2().end()) {
    }

    /// `scene`: that the frame was made of. Throws ConfigError where the table of names is damaged.
    [[nodiscard]] std::shared_ptr<const FrameOverlay> of(const transports::KeptFrame& frame,
                                                         const FrameScene& scene);

    static constexpr std::size_t max_hot_pixels = 256;

private:
    [[nodiscard]] FrameOverlay make(const transports::KeptFrame& frame, const FrameScene& scene);
    void set_names(std::vector<renderer::OverlayStar>& stars);
    [[nodiscard]] std::vector<PixelPlace> hot_pixels_in(const FrameInfo& frame);

    const SensorDescription sensor_;
    const sensors::Detector& detector_; ///< its aperture may change meanwhile
    const double aperture_m_;
    const std::vector<double> electrons_; ///< Detector::electrons_per_s_per_w_m2() with that aperture
    std::mutex mutex_;                    ///< of all below
    std::optional<ephemeris::StarNames> names_;
    std::optional<std::vector<PixelPlace>> hot_; ///< of the sensor
    std::uint64_t serial_ = 0;                   ///< of the frame of `overlay_`, see KeptFrame
    std::shared_ptr<const FrameOverlay> overlay_;
};

} // namespace obscura::emulator
