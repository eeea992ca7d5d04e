// SPDX-License-Identifier: Apache-2.0
// Trigger state of SFNC FrameBurstStart: the frames left of the current burst.
#pragma once

#include "emulator/trigger/shared_trigger_choice.hpp"

#include <atomic>
#include <cstdint>

namespace obscura::emulator {

/// One control thread configures; all other members are thread-safe and real-time safe.
class FrameBurst {
public:
    /// Control side. AcquisitionBurstFrameCount counts from the next burst on.
    void set(const TriggerChoice& trigger, std::uint32_t frame_count) noexcept {
        trigger_.set(trigger);
        frame_count_.store(frame_count, std::memory_order_relaxed);
    }
    /// Control side: ends the current burst.
    void reset() noexcept { left_.store(0, std::memory_order_relaxed); }

    [[nodiscard]] bool accepts(TriggerSource from, bool falling) const noexcept {
        return trigger_.accepts(from, falling);
    }
    [[nodiscard]] bool enabled() const noexcept { return trigger_.enabled(); }
    /// Frames require a burst trigger first.
    [[nodiscard]] bool awaited() const noexcept {
        return trigger_.enabled() && left_.load(std::memory_order_acquire) == 0;
    }
    /// Begins a burst. False while one is in progress.
    bool begin() noexcept {
        std::uint32_t none = 0;
        return left_.compare_exchange_strong(none, frame_count_.load(std::memory_order_relaxed),
                                             std::memory_order_acq_rel);
    }
    /// Counts a frame that the gate has taken.
    void count_frame() noexcept {
        if (trigger_.enabled()) left_.fetch_sub(1, std::memory_order_acq_rel);
    }

private:
    SharedTriggerChoice trigger_;
    std::atomic<std::uint32_t> frame_count_{1}, left_{0};
};

} // namespace obscura::emulator
