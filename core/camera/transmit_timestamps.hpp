// SPDX-License-Identifier: Apache-2.0
// Transmit timestamps of a frame: when its first and its last byte left, by transport.
#pragma once

#include "core/time.hpp"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace obscura {

/// Transports that one camera may have.
constexpr std::size_t max_transports = 8;

/// First and last transmit time of each transport, by its slot: its number among the camera's transports.
/// Each slot is written by one transport's threads and read by any. Real-time safe.
class TransmitTimestamps {
public:
    /// Bytes of the frame were handed to the kernel at `now` (scheduling clock): sets the last time, and the
    /// first one if there is none yet.
    void note(std::size_t slot, Time now) noexcept {
        Slot& s = slots_[slot];
        if (s.first.load(std::memory_order_relaxed) == 0) s.first.store(now.ns, std::memory_order_relaxed);
        s.last.store(now.ns, std::memory_order_relaxed);
    }
    /// 0: nothing has left.
    [[nodiscard]] Time first(std::size_t slot) const noexcept {
        return Time{slots_[slot].first.load(std::memory_order_relaxed)};
    }
    [[nodiscard]] Time last(std::size_t slot) const noexcept {
        return Time{slots_[slot].last.load(std::memory_order_relaxed)};
    }
    void clear() noexcept {
        for (Slot& s : slots_) {
            s.first.store(0, std::memory_order_relaxed);
            s.last.store(0, std::memory_order_relaxed);
        }
    }

private:
    struct Slot {
        std::atomic<std::int64_t> first{0}, last{0};
    };
    std::array<Slot, max_transports> slots_;
};

} // namespace obscura
