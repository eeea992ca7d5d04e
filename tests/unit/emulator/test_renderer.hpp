// SPDX-License-Identifier: Apache-2.0
// A renderer for pipeline tests: light that is known in closed form, and that can be held back.
#pragma once

#include "core/camera/frame_quality.hpp"

#include <atomic>
#include <cstdint>
#include <functional>

namespace obscura::test {

/// Holds every render() back while closed, but for those of a thread alone; shared by all renderers of the
/// program.
struct RenderGate {
    std::atomic<bool> closed{false};
    std::atomic<std::uint32_t> waiting{0};      ///< renders that stand at the gate
    std::atomic<std::uint32_t> bands{0};        ///< bands rendered since the start
    std::function<void(QualityLevel)> row_work; ///< called for each row, if any

    void close() { closed = true; }
    void open() {
        closed = false;
        closed.notify_all();
    }
    /// Blocks until a render stands at the gate.
    void wait_for_render() const {
        while (waiting.load() == 0)
            waiting.wait(0);
    }
};
RenderGate& render_gate();

/// Apparent motion in every scene.
inline constexpr double motion_px_per_s = 10;

/// Where the scene's live poses are now: an image of another place is so many pixels off.
inline std::atomic<double> live_px{0};

/// Age of the camera's pose.
inline std::atomic<double> pose_age_s{0};

/// The same of the light of its lamps, if it has any.
inline std::atomic<double> lamp_px{0};

/// Whether an earlier frame can be reprojected.
inline std::atomic<bool> frames_are_kept{false};

/// What the test renderer shows: W/m2 at sensor pixel (x, y) seen at scene time `mid_ns` in frame `frame_id`.
float test_irradiance(std::int32_t x, std::int32_t y, std::int64_t mid_ns, std::uint64_t frame_id);

} // namespace obscura::test
