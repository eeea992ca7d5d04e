// SPDX-License-Identifier: Apache-2.0
// Pixel probes of a daemon's cameras, on one thread of idle priority, made when they are asked for.
#pragma once

#include "core/realtime/realtime.hpp"
#include "emulator/control/idle_thread.hpp"
#include "emulator/unit/camera_unit.hpp"
#include "emulator/unit/pixel_probe.hpp"

#include <oneapi/tbb/task_arena.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <vector>

namespace obscura::emulator {

/// A probe has its camera's scene once more; it goes when the scene does, or after a while without a request.
/// Thread-safe.
class PixelProbes {
public:
    /// Without a request for so long, memory and thread are given back.
    static constexpr std::chrono::minutes unused{5};

    /// `cores` of the thread; empty: any.
    explicit PixelProbes(const CoreSet& cores, std::chrono::milliseconds unused_for = unused);

    /// A pixel of a frame of a camera, in a window of it. Throws Failure: also not-now for a scene that
    /// cannot be loaded any more, and as IdleThread::run() does.
    [[nodiscard]] ProbedPixel probe(std::size_t camera, const CameraUnit::ProbeSource& source,
                                    const FrameInfo& info, const std::vector<RowTime>& row_times,
                                    std::int32_t x, std::int32_t y, const std::atomic<bool>& given_up);
    /// Irradiance of all pixels of such a frame, see PixelProbe::irradiance(). Throws as probe().
    [[nodiscard]] std::vector<float> irradiance(std::size_t camera, const CameraUnit::ProbeSource& source,
                                                const FrameInfo& info, const std::vector<RowTime>& row_times,
                                                const std::atomic<bool>& given_up);
    /// Refuses requests from now on.
    void close() { thread_.close(); }
    /// Scenes that are held now.
    [[nodiscard]] std::size_t held() const noexcept { return held_.load(); }

private:
    /// What `ask` answers of the camera's probe and the frame, on the thread.
    template<typename Answer, typename Ask>
    [[nodiscard]] Answer answer_of(std::size_t camera, const CameraUnit::ProbeSource& source,
                                   const FrameInfo& info, const std::vector<RowTime>& row_times, Ask ask,
                                   const std::atomic<bool>& given_up);
    [[nodiscard]] PixelProbe& probe_of(std::size_t camera, const CameraUnit::ProbeSource& source);

    // Used by the thread alone:
    tbb::task_arena alone_{1}; ///< so that workers of other renderers take no part in building a scene
    std::map<std::size_t, std::unique_ptr<PixelProbe>> probes_;
    std::atomic<std::size_t> held_{0};

    IdleThread thread_; ///< ends first
};

} // namespace obscura::emulator
