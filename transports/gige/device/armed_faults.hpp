// SPDX-License-Identifier: Apache-2.0
// Fault rules in force and their strikes: those of the configuration, of calls and of TestControl.
#pragma once

#include "core/text/enum_names.hpp"
#include "transports/gige/settings.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace obscura::transports::gige {

/// Origin of a fault rule.
enum class FaultOrigin : std::uint8_t { configuration, call, feature };
constexpr auto enum_names(FaultOrigin /*type*/) {
    return std::array{EnumName{FaultOrigin::configuration, "configuration"},
                      EnumName{FaultOrigin::call, "call"}, EnumName{FaultOrigin::feature, "feature"}};
}

/// A rule in force, with the seed that it uses and a counter of its strikes.
struct ArmedFault {
    FaultRule rule;
    FaultOrigin origin = FaultOrigin::configuration;
    std::string label; ///< in the statistics: "rule_1_lose"
    [[nodiscard]] std::uint64_t struck() const noexcept {
        return rule.struck->load(std::memory_order_relaxed);
    }
};

/// The rules in force. FaultPercent and FaultAmount of a kind show, and change, the first plain rule of that
/// kind that is not of the configuration: one with share and amount only, for all frames, in the steps of the
/// features. Changed on the control thread, read from any.
class ArmedFaults {
public:
    /// `seed`: of rules without one of their own.
    ArmedFaults(const GigeSettings& settings, std::uint64_t seed);

    /// Replaces all rules. One that is in force already stays, with its strikes and its origin.
    void replace(const std::vector<FaultRule>& rules);
    /// Arms the plain rule of a kind, changes its share, or disarms it with 0 percent. `amount` is that of a
    /// new one.
    void set_percent(Fault fault, double percent, double amount);
    void set_amount(Fault fault, double amount);

    /// Share and amount of the plain rule of a kind; none: there is no such rule.
    struct Plain {
        double percent = 0, amount = 0;
    };
    [[nodiscard]] std::optional<Plain> plain(Fault fault) const;
    [[nodiscard]] std::vector<ArmedFault> all() const;
    [[nodiscard]] std::vector<FaultRule> rules() const;
    /// Strikes of all rules of a kind that are in force.
    [[nodiscard]] std::uint64_t struck(Fault fault) const;
    /// Strikes of all rules of a kind since the start, also of those that have been replaced: never less than
    /// before.
    [[nodiscard]] std::uint64_t struck_since_start(Fault fault) const noexcept;
    /// Strikes by label: those of the rules in force, and of features that are disarmed but have struck.
    [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> strikes() const;

private:
    using Counter = std::shared_ptr<std::atomic<std::uint64_t>>;

    [[nodiscard]] std::vector<ArmedFault>::iterator find_plain(Fault fault);
    /// The rule in force, with the seed that it uses and its counters.
    [[nodiscard]] ArmedFault armed(FaultRule rule, FaultOrigin origin, std::string label,
                                   Counter struck) const;

    const std::uint64_t seed_;
    mutable std::mutex mutex_;
    std::vector<ArmedFault> armed_;
    std::array<Counter, fault_count> of_features_; ///< since the start, by kind
    std::array<Counter, fault_count> of_all_;      ///< of all rules
};

} // namespace obscura::transports::gige
