// SPDX-License-Identifier: Apache-2.0
// Numbers of saturated pixels of the newest frames.
#pragma once

#include "core/camera/frame.hpp"
#include "core/time.hpp"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>

namespace obscura::transports {

/// Counted while they are requested. Thread-safe.
class SaturationCounts {
public:
    /// Frames whose number is kept.
    static constexpr std::size_t most = 256;

    /// Frames are counted until `until` (CLOCK_MONOTONIC) at least.
    void want(Time until) noexcept;
    [[nodiscard]] bool wanted(Time now) const noexcept;
    /// Counts the pixels of a frame that has ended, of the rows that are there, if that is wanted. On one
    /// thread.
    void note(const Frame& frame, Time now);
    /// Pixels at the largest digital number of the frame of a trigger edge; none: it was not counted.
    [[nodiscard]] std::optional<std::uint32_t> of(std::uint64_t frame_id, Time edge) const;

private:
    struct Entry {
        std::uint64_t frame_id = 0; ///< 0: none
        Time edge;
        std::uint32_t pixels = 0;
    };
    std::atomic<std::int64_t> until_ns_{0};
    mutable std::mutex mutex_;
    std::array<Entry, most> entries_{};
    std::size_t next_ = 0;
};

} // namespace obscura::transports
