// SPDX-License-Identifier: Apache-2.0
// Lock-free single-producer, single-consumer ring of fixed capacity.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <utility>

namespace obscura {

/// Queue between one pushing and one popping thread; real-time safe for elements that move without
/// allocation. Unused elements are default-constructed.
template<typename T, std::size_t capacity>
class SpscRing {
public:
    bool push(T value) noexcept {
        const std::size_t head = head_.load(std::memory_order_relaxed);
        if (head - tail_.load(std::memory_order_acquire) == capacity) return false;
        cells_[head % capacity] = std::move(value);
        head_.store(head + 1, std::memory_order_release);
        return true;
    }
    bool pop(T& value) noexcept {
        const std::size_t tail = tail_.load(std::memory_order_relaxed);
        if (tail == head_.load(std::memory_order_acquire)) return false;
        value = std::exchange(cells_[tail % capacity], T{});
        tail_.store(tail + 1, std::memory_order_release);
        return true;
    }
    [[nodiscard]] bool empty() const noexcept {
        return tail_.load(std::memory_order_acquire) == head_.load(std::memory_order_acquire);
    }

private:
    std::array<T, capacity> cells_{};
    alignas(64) std::atomic<std::size_t> head_{0};
    alignas(64) std::atomic<std::size_t> tail_{0};
};

} // namespace obscura
