// SPDX-License-Identifier: Apache-2.0
// Lock-free single-producer, single-consumer queue of frames, from the pipeline thread to a transport thread.
#pragma once

#include "core/camera/frame.hpp"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <vector>

namespace obscura::transports {

/// Queue of fixed capacity between one thread that pushes and one that pops. A frame counts against the
/// capacity until pop(), not only until front(). Real-time safe after construction.
class FrameQueue {
public:
    /// Room for `capacity` frames, one at least.
    explicit FrameQueue(std::size_t capacity) : slots_(std::max<std::size_t>(capacity, 1)) {}

    /// False when the queue is full.
    bool push(const FrameRef& frame) noexcept {
        const std::size_t head = head_.load(std::memory_order_relaxed);
        if (head - tail_.load(std::memory_order_acquire) >= slots_.size()) return false;
        slots_[head % slots_.size()] = frame;
        head_.store(head + 1, std::memory_order_release);
        return true;
    }
    /// The oldest frame, which stays in the queue; null if there is none.
    [[nodiscard]] FrameRef front() const noexcept {
        const std::size_t tail = tail_.load(std::memory_order_relaxed);
        if (tail == head_.load(std::memory_order_acquire)) return {};
        return slots_[tail % slots_.size()];
    }
    /// Removes the oldest frame; the queue must not be empty.
    void pop() noexcept {
        const std::size_t tail = tail_.load(std::memory_order_relaxed);
        slots_[tail % slots_.size()] = FrameRef{};
        tail_.store(tail + 1, std::memory_order_release);
    }

private:
    std::vector<FrameRef> slots_;      ///< frame i is in slot i % size
    std::atomic<std::size_t> head_{0}; ///< frames pushed
    std::atomic<std::size_t> tail_{0}; ///< frames popped
};

} // namespace obscura::transports
