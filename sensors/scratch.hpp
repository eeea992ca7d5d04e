// SPDX-License-Identifier: Apache-2.0
// Row buffers for Detector::expose(), allocated once and lent without locks.
#pragma once

#include "sensors/kernels.hpp"
#include "sensors/particle_hits.hpp"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

namespace obscura::sensors {

/// Row buffers of one call of expose(). Every row has kernels::padding elements before its first pixel and
/// after its last.
class Scratch {
public:
    static constexpr std::size_t ring = 4; ///< rows kept of each kind
    static constexpr std::size_t hits_kept = 4096;

    explicit Scratch(std::size_t width)
        : stride_(width + 2 * kernels::padding), rows_(row_count * stride_), dn_(stride_) {
        hits.reserve(hits_kept);
    }

    [[nodiscard]] float* raw(std::size_t i) { return row(i % ring); }
    [[nodiscard]] float* mean(std::size_t i) { return row(ring + i % ring); }
    [[nodiscard]] float* mixed() { return row(2 * ring); }
    [[nodiscard]] float* excess() { return row(2 * ring + 1); }
    [[nodiscard]] float* smear() { return row(2 * ring + 2); }
    [[nodiscard]] float* counts() { return row(2 * ring + 3); }
    [[nodiscard]] float* sum() { return row(2 * ring + 4); }
    [[nodiscard]] float* z0() { return row(2 * ring + 5); }
    [[nodiscard]] float* z1() { return row(2 * ring + 6); }
    [[nodiscard]] float* frozen() { return row(2 * ring + 7); }
    [[nodiscard]] float* signal() { return row(2 * ring + 8); }
    /// Four contiguous rows, for kernels::poisson_row().
    [[nodiscard]] float* sampler() { return row(2 * ring + 9); }
    [[nodiscard]] std::uint16_t* dn() { return dn_.data(); }
    std::vector<ParticleHit> hits; ///< never more than hits_kept

private:
    static constexpr std::size_t row_count = 2 * ring + 9 + 5;
    [[nodiscard]] float* row(std::size_t i) { return rows_.data() + i * stride_ + kernels::padding; }

    std::size_t stride_;
    std::vector<float> rows_;
    std::vector<std::uint16_t> dn_;
};

/// Pool of Scratch, sized for the threads that may expose at the same time. A further thread spins until one
/// is returned.
class ScratchPool {
    struct Slot {
        explicit Slot(std::size_t width) : scratch(width) {}
        std::atomic<bool> taken{false};
        Scratch scratch;
    };

public:
    explicit ScratchPool(std::size_t width) {
        const std::size_t count = std::max<std::size_t>(8, 2 * std::thread::hardware_concurrency());
        for (std::size_t i = 0; i < count; ++i)
            slots_.push_back(std::make_unique<Slot>(width));
    }

    /// Owner of one Scratch of the pool; returns it on destruction.
    class Lease {
    public:
        explicit Lease(const ScratchPool& pool) noexcept : slot_(pool.take()) {}
        ~Lease() { slot_.taken.store(false, std::memory_order_release); }
        Lease(const Lease&) = delete;
        Lease& operator=(const Lease&) = delete;
        [[nodiscard]] Scratch& operator*() const noexcept { return slot_.scratch; }

    private:
        Slot& slot_;
    };

private:
    [[nodiscard]] Slot& take() const noexcept {
        for (;; std::this_thread::yield())
            for (const auto& slot : slots_) {
                bool free = false;
                if (slot->taken.compare_exchange_strong(free, true, std::memory_order_acquire)) return *slot;
            }
    }

    std::vector<std::unique_ptr<Slot>> slots_;
};

} // namespace obscura::sensors
