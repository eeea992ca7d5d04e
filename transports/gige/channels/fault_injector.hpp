// SPDX-License-Identifier: Apache-2.0
// Fault injector: the packets and frames that a rule strikes are a pure function of seed, block and packet.
#pragma once

#include "transports/gige/wire/fault.hpp"

#include <atomic>
#include <cstdint>
#include <utility>
#include <vector>

namespace obscura::transports::gige {

/// Evaluates fault rules. strikes() is thread-safe and real-time safe while the rules do not change.
class FaultInjector {
public:
    void set_rules(std::vector<FaultRule> rules) { rules_ = std::move(rules); }
    [[nodiscard]] bool any() const noexcept { return !rules_.empty(); }
    /// Counts a strike of `rule` that took effect. Thread-safe and real-time safe.
    static void count(const FaultRule& rule) noexcept {
        if (rule.struck) rule.struck->fetch_add(1, std::memory_order_relaxed);
        if (rule.struck_of_kind) rule.struck_of_kind->fetch_add(1, std::memory_order_relaxed);
    }
    /// The rule for `fault` that strikes packet `packet` (0 for faults of whole frames) of frame `frame`, or
    /// null.
    [[nodiscard]] const FaultRule* strikes(Fault fault, std::uint64_t frame,
                                           std::uint32_t packet = 0) const noexcept;

private:
    std::vector<FaultRule> rules_;
};

} // namespace obscura::transports::gige
