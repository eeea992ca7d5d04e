// SPDX-License-Identifier: Apache-2.0
// Fault injector: the packets and frames that a rule strikes are a pure function of seed, block and packet.
#pragma once

#include "transports/gige/wire/fault.hpp"

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace obscura::transports::gige {

/// Strikes of each rule (packets, frames or commands) since the camera was made, by FaultRule::counter.
/// Thread-safe, real-time safe after construction.
class FaultCounters {
public:
    explicit FaultCounters(std::size_t rules) : strikes_(rules) {}
    void add(std::size_t counter) noexcept {
        if (counter < strikes_.size()) strikes_[counter].fetch_add(1, std::memory_order_relaxed);
    }
    [[nodiscard]] std::uint64_t operator[](std::size_t counter) const noexcept {
        return counter < strikes_.size() ? strikes_[counter].load(std::memory_order_relaxed) : 0;
    }

private:
    std::vector<std::atomic<std::uint64_t>> strikes_;
};

/// Evaluates fault rules. strikes() is thread-safe and real-time safe while the rules do not change.
class FaultInjector {
public:
    void set_rules(std::vector<FaultRule> rules) { rules_ = std::move(rules); }
    /// Counters that copies of this injector share; null: strikes are not counted.
    void set_counters(std::shared_ptr<FaultCounters> counters) { counters_ = std::move(counters); }
    [[nodiscard]] bool any() const noexcept { return !rules_.empty(); }
    /// Counts a strike of `rule` that took effect. Thread-safe and real-time safe.
    void count(const FaultRule& rule) const noexcept {
        if (counters_) counters_->add(rule.counter);
    }
    /// The rule for `fault` that strikes packet `packet` (0 for faults of whole frames) of frame `frame`, or
    /// null.
    [[nodiscard]] const FaultRule* strikes(Fault fault, std::uint64_t frame,
                                           std::uint32_t packet = 0) const noexcept;

private:
    std::vector<FaultRule> rules_;
    std::shared_ptr<FaultCounters> counters_;
};

} // namespace obscura::transports::gige
