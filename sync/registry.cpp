#include "sync/registry.hpp"

#include "core/error.hpp"
#include "sync/timer.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace obscura::sync {
namespace {

std::unique_ptr<TriggerSource> make_timer(const SourceSettings& s) {
    TimerSettings settings;
    try {
        settings.rate = rational_rate(s.rate_hz);
    } catch (const std::invalid_argument& e) {
        throw ConfigError(fmt::format("trigger.rate_hz: {}: {}", s.rate_hz, e.what()));
    }
    settings.phase_ns = s.phase_ns;
    settings.priority = s.priority;
    return std::make_unique<TimerTrigger>(settings, std::make_unique<MonotonicClock>());
}

struct Kind {
    const char* name;
    std::unique_ptr<TriggerSource> (*make)(const SourceSettings&);
};

// One line for each kind of source.
constexpr Kind kinds[] = {
    {"timer", make_timer},
};

} // namespace

std::unique_ptr<TriggerSource> make_source(const SourceSettings& settings) {
    if (settings.kind == "none") return nullptr;
    for (const Kind& kind : kinds)
        if (settings.kind == kind.name) return kind.make(settings);
    throw ConfigError(
        fmt::format("trigger.source: \"{}\" is not known, allowed: {}", settings.kind, source_kinds()));
}

std::string source_kinds() {
    std::string names = "none";
    for (const Kind& kind : kinds)
        names += fmt::format(", {}", kind.name);
    return names;
}

} // namespace obscura::sync
