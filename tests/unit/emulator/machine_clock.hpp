// SPDX-License-Identifier: Apache-2.0
// Clock of a machine of known speed: time is the work that a renderer has done.
#pragma once

#include "core/clock.hpp"
#include "renderer/renderer.hpp"

#include <atomic>
#include <functional>
#include <utility>

namespace obscura::test {

/// Each ray and each sample of the renderer takes the same time, other programs none unless told.
class MachineClock final : public Clock {
public:
    explicit MachineClock(const renderer::Renderer& renderer) : renderer_(renderer) {}

    [[nodiscard]] Time now() const noexcept override {
        const std::uint64_t work = renderer_.rays_traced() + renderer_.samples_taken();
        if (on_read && !std::exchange(reading_, true)) {
            on_read();
            reading_ = false;
        }
        // The stall comes in the midst of work.
        if (const std::int64_t ns = stall_ns_.load(); ns > 0 && work > stall_at_.load()) {
            stalled_ns_ += ns;
            stall_ns_ = 0;
        }
        return Time{static_cast<std::int64_t>(work) * ns_per_work + stalled_ns_.load()};
    }
    /// Other programs have the machine for so long once there is work.
    void stall(std::int64_t ns) noexcept {
        stall_at_ = renderer_.rays_traced() + renderer_.samples_taken();
        stall_ns_ = ns;
    }
    std::function<void()> on_read; ///< called by now(), but not within itself

    bool sleep_until(Time /*deadline*/) noexcept override { return true; }
    void interrupt() noexcept override {}
    void rearm() noexcept override {}
    [[nodiscard]] std::int64_t tai_offset_ns() const noexcept override { return 0; }

private:
    static constexpr std::int64_t ns_per_work = 1000;
    const renderer::Renderer& renderer_;
    mutable bool reading_ = false;
    mutable std::atomic<std::int64_t> stall_ns_{0}, stalled_ns_{0};
    std::atomic<std::uint64_t> stall_at_{0};
};

} // namespace obscura::test
