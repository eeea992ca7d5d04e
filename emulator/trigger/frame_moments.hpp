// SPDX-License-Identifier: Apache-2.0
// Instants of the current frame, published by the pipeline thread.
#pragma once

#include "core/camera/camera.hpp"
#include "core/time.hpp"

#include <atomic>
#include <cstdint>

namespace obscura::emulator {

/// Instants of one frame, scheduling clock.
struct FrameInstants {
    std::uint64_t frame_id = 0;
    Time frame_start, frame_end;       ///< trigger edge, last row out of the chip
    Time exposure_start, exposure_end; ///< first reset, last read
};

/// Camera state for the output lines.
struct CameraMoments {
    std::uint64_t frames = 0;          ///< frames begun
    std::uint64_t frame_id = 0;        ///< id of the last frame begun
    Time exposure_start, exposure_end; ///< exposure of the last frame begun, scheduling clock
    bool ready = false;                ///< an edge at or after `not_before` would be accepted
    Time not_before;
};

/// Instants of the last frame begun. The pipeline thread writes, any thread reads; real-time safe. A reader
/// may see instants of two consecutive frames.
class FrameMoments {
public:
    void publish(const FrameInstants& instants) noexcept {
        frame_start_ns_.store(instants.frame_start.ns, std::memory_order_relaxed);
        frame_end_ns_.store(instants.frame_end.ns, std::memory_order_relaxed);
        exposure_start_ns_.store(instants.exposure_start.ns, std::memory_order_relaxed);
        exposure_end_ns_.store(instants.exposure_end.ns, std::memory_order_relaxed);
        frame_id_.store(instants.frame_id, std::memory_order_relaxed);
        frames_.fetch_add(1, std::memory_order_release);
    }
    void fill(CameraActivity& a) const noexcept {
        a.frames = frames_.load(std::memory_order_acquire);
        a.frame_start = Time{frame_start_ns_.load(std::memory_order_relaxed)};
        a.frame_end = Time{frame_end_ns_.load(std::memory_order_relaxed)};
        a.exposure_start = Time{exposure_start_ns_.load(std::memory_order_relaxed)};
        a.exposure_end = Time{exposure_end_ns_.load(std::memory_order_relaxed)};
    }
    void fill(CameraMoments& m) const noexcept {
        m.frames = frames_.load(std::memory_order_acquire);
        m.frame_id = frame_id_.load(std::memory_order_relaxed);
        m.exposure_start = Time{exposure_start_ns_.load(std::memory_order_relaxed)};
        m.exposure_end = Time{exposure_end_ns_.load(std::memory_order_relaxed)};
    }

private:
    std::atomic<std::uint64_t> frames_{0}, frame_id_{0};
    std::atomic<std::int64_t> frame_start_ns_{0}, frame_end_ns_{0};
    std::atomic<std::int64_t> exposure_start_ns_{0}, exposure_end_ns_{0};
};

} // namespace obscura::emulator
