// SPDX-License-Identifier: Apache-2.0
// TriggerChoice shared between the control side and the threads of the trigger sources.
#pragma once

#include "core/camera/trigger.hpp"

#include <atomic>

namespace obscura::emulator {

/// One thread writes, any thread reads; real-time safe. A reader may see source and activation of two
/// consecutive choices.
class SharedTriggerChoice {
public:
    void set(const TriggerChoice& choice) noexcept {
        source_.store(choice.source, std::memory_order_relaxed);
        activation_.store(choice.activation, std::memory_order_relaxed);
        enabled_.store(choice.enabled, std::memory_order_release);
    }
    [[nodiscard]] TriggerChoice get() const noexcept { return {enabled(), source(), activation()}; }
    [[nodiscard]] bool enabled() const noexcept { return enabled_.load(std::memory_order_acquire); }
    [[nodiscard]] TriggerSource source() const noexcept { return source_.load(std::memory_order_relaxed); }
    [[nodiscard]] TriggerActivation activation() const noexcept {
        return activation_.load(std::memory_order_relaxed);
    }
    /// TriggerChoice::accepts().
    [[nodiscard]] bool accepts(TriggerSource from, bool falling) const noexcept {
        return get().accepts(from, falling);
    }

private:
    std::atomic<bool> enabled_{false};
    std::atomic<TriggerSource> source_{TriggerSource::line0};
    std::atomic<TriggerActivation> activation_{TriggerActivation::rising_edge};
};

} // namespace obscura::emulator
