// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/device/armed_faults.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace obscura::transports::gige {
namespace {

/// Steps and ranges of FaultPercent and FaultAmount.
constexpr double percent_steps = 1000, amount_max = 1e6;

bool is_plain(const FaultRule& rule, std::uint64_t seed) {
    const double steps = rule.percent * percent_steps;
    const FaultRule plain{.fault = rule.fault, .percent = rule.percent, .amount = rule.amount, .seed = seed};
    return same_rule(rule, plain) && std::abs(steps - std::round(steps)) < 1e-6 && steps >= 1 &&
           rule.amount >= 0 && rule.amount <= amount_max && rule.amount == std::floor(rule.amount);
}

std::shared_ptr<std::atomic<std::uint64_t>> new_counter() {
    return std::make_shared<std::atomic<std::uint64_t>>(0);
}

} // namespace

ArmedFaults::ArmedFaults(const GigeSettings& settings, std::uint64_t seed) : seed_(seed) {
    for (std::size_t kind = 0; kind < fault_count; ++kind) {
        of_features_[kind] = new_counter();
        of_all_[kind] = new_counter();
    }
    for (const FaultRule& rule : settings.faults)
        armed_.push_back(armed(rule, FaultOrigin::configuration,
                               fmt::format("rule_{}_{}", armed_.size() + 1, name_of(rule.fault)),
                               new_counter()));
    if (settings.drop_percent > 0)
        armed_.push_back(armed({.fault = Fault::lose, .percent = settings.drop_percent},
                               FaultOrigin::configuration, "drop_percent", new_counter()));
}

ArmedFault ArmedFaults::armed(FaultRule rule, FaultOrigin origin, std::string label, Counter struck) const {
    if (rule.seed == 0) rule.seed = seed_;
    rule.struck = std::move(struck);
    rule.struck_of_kind = of_all_[static_cast<std::size_t>(rule.fault)];
    return {std::move(rule), origin, std::move(label)};
}

void ArmedFaults::replace(const std::vector<FaultRule>& rules) {
    const std::lock_guard lock(mutex_);
    std::vector<ArmedFault> before = std::move(armed_);
    armed_.clear();
    for (const FaultRule& rule : rules) {
        ArmedFault next =
            armed(rule, FaultOrigin::call, fmt::format("call_{}_{}", armed_.size() + 1, name_of(rule.fault)),
                  new_counter());
        const auto same = std::find_if(before.begin(), before.end(), [&next](const ArmedFault& old) {
            return same_rule(old.rule, next.rule);
        });
        if (same == before.end()) {
            armed_.push_back(std::move(next));
            continue;
        }
        armed_.push_back(std::move(*same));
        before.erase(same);
    }
}

std::vector<ArmedFault>::iterator ArmedFaults::find_plain(Fault fault) {
    return std::find_if(armed_.begin(), armed_.end(), [&](const ArmedFault& one) {
        return one.origin != FaultOrigin::configuration && one.rule.fault == fault &&
               is_plain(one.rule, seed_);
    });
}

void ArmedFaults::set_percent(Fault fault, double percent, double amount) {
    const std::lock_guard lock(mutex_);
    const auto found = find_plain(fault);
    if (found != armed_.end() && percent > 0) {
        found->rule.percent = percent;
    } else if (found != armed_.end()) {
        armed_.erase(found);
    } else if (percent > 0) {
        armed_.push_back(armed({.fault = fault, .percent = percent, .amount = amount}, FaultOrigin::feature,
                               fmt::format("live_{}", name_of(fault)),
                               of_features_[static_cast<std::size_t>(fault)]));
    }
}

void ArmedFaults::set_amount(Fault fault, double amount) {
    const std::lock_guard lock(mutex_);
    if (const auto found = find_plain(fault); found != armed_.end()) found->rule.amount = amount;
}

std::optional<ArmedFaults::Plain> ArmedFaults::plain(Fault fault) const {
    const std::lock_guard lock(mutex_);
    const auto found = const_cast<ArmedFaults*>(this)->find_plain(fault);
    if (found == armed_.end()) return std::nullopt;
    return Plain{found->rule.percent, found->rule.amount};
}

std::vector<ArmedFault> ArmedFaults::all() const {
    const std::lock_guard lock(mutex_);
    return armed_;
}

std::vector<FaultRule> ArmedFaults::rules() const {
    std::vector<FaultRule> rules;
    for (const ArmedFault& one : all())
        rules.push_back(one.rule);
    return rules;
}

std::uint64_t ArmedFaults::struck(Fault fault) const {
    std::uint64_t sum = 0;
    for (const ArmedFault& one : all())
        if (one.rule.fault == fault) sum += one.struck();
    return sum;
}

std::uint64_t ArmedFaults::struck_since_start(Fault fault) const noexcept {
    return of_all_[static_cast<std::size_t>(fault)]->load(std::memory_order_relaxed);
}

std::vector<std::pair<std::string, std::uint64_t>> ArmedFaults::strikes() const {
    std::vector<std::pair<std::string, std::uint64_t>> strikes;
    for (const ArmedFault& one : all())
        strikes.emplace_back(one.label, one.struck());
    for (const auto& [fault, name] : enum_names(Fault{})) {
        const std::uint64_t n = *of_features_[static_cast<std::size_t>(fault)];
        const std::string label = fmt::format("live_{}", name);
        const bool listed =
            std::any_of(strikes.begin(), strikes.end(), [&](const auto& one) { return one.first == label; });
        if (n > 0 && !listed) strikes.emplace_back(label, n);
    }
    return strikes;
}

} // namespace obscura::transports::gige
