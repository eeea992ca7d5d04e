// SPDX-License-Identifier: Apache-2.0
// How the newest frames were made: renderer, scene time, black level; written by the pipeline thread.
#pragma once

#include "core/time.hpp"
#include "emulator/camera/scene_clock.hpp"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace obscura::renderer {
class Renderer;
}

namespace obscura::emulator {

/// What FrameInfo does not say of a frame.
struct FrameOrigin {
    std::uint64_t frame_id = 0;
    Time trigger_edge; ///< with frame_id it tells frames apart
    /// Renderer that made its light; used for comparison only, since it may have been destroyed.
    const renderer::Renderer* renderer = nullptr;
    std::int64_t scene_to_clock_ns = 0; ///< scheduling clock minus the time of the readout's plan
    SceneShown shown{};                 ///< from that time to the time of the scene that is rendered
    double black_level_dn = 0;
    bool pattern = false; ///< its digital numbers are those of a test pattern

    [[nodiscard]] Time planned(Time clock) const noexcept { return clock - scene_to_clock_ns; }
};

/// Origins of the latest frames. One thread notes, which is real-time safe; any thread reads, without a lock.
class FrameOrigins {
public:
    static constexpr std::size_t capacity = 1024;

    void note(const FrameOrigin& origin) noexcept;
    /// None: the frame is not one of the latest.
    [[nodiscard]] std::optional<FrameOrigin> find(std::uint64_t frame_id, Time trigger_edge) const noexcept;

private:
    static constexpr std::size_t word_count = 9;
    struct Cell {
        std::atomic<std::uint64_t> sequence{0}; ///< odd while it is written
        std::array<std::atomic<std::uint64_t>, word_count> words{};
    };
    std::array<Cell, capacity> cells_{}; ///< origin n in cell n % capacity
    std::atomic<std::uint64_t> count_{0};
};

} // namespace obscura::emulator
