#include "sync/registry.hpp"

#include "core/error.hpp"
#include "sync/gpio_input.hpp"
#include "sync/pps_input.hpp"
#include "sync/pps_trigger.hpp"
#include "sync/ptp_input.hpp"
#include "sync/ptp_timer.hpp"
#include "sync/software.hpp"
#include "sync/timer.hpp"
#include "sync/udp_input.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace obscura::sync {
namespace {

RationalRate rate_of(const SourceSettings& s) {
    try {
        return rational_rate(s.rate_hz);
    } catch (const std::invalid_argument& e) {
        throw ConfigError(fmt::format("trigger.rate_hz: {}: {}", s.rate_hz, e.what()));
    }
}

EdgeTriggerSettings edge_settings(const char* name, const SourceSettings& s) {
    return {.name = name,
            .thread = s.thread,
            .nominal_period_ns = static_cast<std::int64_t>(1e9 / rate_of(s).hz())};
}

std::unique_ptr<TriggerSource> make_timer(const SourceSettings& s, const Clock& /*clock*/) {
    TimerSettings settings;
    settings.rate = rate_of(s);
    settings.phase_ns = s.phase_ns;
    settings.thread = s.thread;
    return std::make_unique<TimerTrigger>(settings, std::make_unique<MonotonicClock>());
}

std::unique_ptr<TriggerSource> make_gpio(const SourceSettings& s, const Clock& clock) {
    if (s.line.empty())
        throw ConfigError(
            "trigger.line: is missing, the name of a GPIO line or \"gpiochipN:OFFSET\" is wanted");
    GpioSettings gpio;
    gpio.line = s.line;
    gpio.edge = s.edge == "falling" ? GpioEdge::falling
                : s.edge == "both"  ? GpioEdge::both
                                    : GpioEdge::rising;
    gpio.debounce_ns = s.debounce_ns;
    return std::make_unique<EdgeTrigger>(
        edge_settings("gpio", s), [gpio] { return open_gpio(gpio); }, clock);
}

std::unique_ptr<TriggerSource> make_pps(const SourceSettings& s, const Clock& /*clock*/) {
    const std::string device = s.device.empty() ? "/dev/pps0" : s.device;
    return std::make_unique<PpsTrigger>(
        PpsSettings{.rate = rate_of(s), .phase_ns = s.phase_ns}, s.thread,
        [device] { return open_pps(device); }, std::make_unique<MonotonicClock>());
}

std::unique_ptr<TriggerSource> make_ptp(const SourceSettings& s, const Clock& clock) {
    const std::string device = s.device.empty() ? "/dev/ptp0" : s.device;
    return std::make_unique<EdgeTrigger>(
        edge_settings("ptp", s), [device, channel = s.channel] { return open_ptp(device, channel); }, clock);
}

std::unique_ptr<TriggerSource> make_udp(const SourceSettings& s, const Clock& clock) {
    return std::make_unique<EdgeTrigger>(
        edge_settings("udp", s), [listen = s.listen] { return open_udp(listen); }, clock);
}

std::unique_ptr<TriggerSource> make_ptp_timer(const SourceSettings& s, const Clock& /*clock*/) {
    const std::string device = s.device.empty() ? "/dev/ptp0" : s.device;
    PtpTimerSettings settings;
    settings.rate = rate_of(s);
    settings.phase_ns = s.phase_ns;
    settings.thread = s.thread;
    if (!s.start.empty()) {
        settings.start = parse_start(s.start);
        if (!settings.start)
            throw ConfigError(fmt::format(
                "trigger.start: \"{}\": seconds like \"1795244437.5\" are wanted, with up to nine decimals",
                s.start));
    }
    return std::make_unique<PtpTimer>(
        settings, [device] { return open_ptp_clock(device); }, std::make_unique<MonotonicClock>());
}

std::unique_ptr<TriggerSource> make_lockstep(const SourceSettings& /*s*/, const Clock& clock) {
    return std::make_unique<SoftwareTrigger>(clock);
}

struct Kind {
    const char* name;
    std::unique_ptr<TriggerSource> (*make)(const SourceSettings&, const Clock&);
};

// One line for each kind of source.
constexpr Kind kinds[] = {
    {"timer", make_timer},       {"ptp_timer", make_ptp_timer},
    {"gpio", make_gpio},         {"pps", make_pps},
    {"ptp", make_ptp},           {"udp", make_udp},
    {"lockstep", make_lockstep},
};

} // namespace

std::unique_ptr<TriggerSource> make_source(const SourceSettings& settings, const Clock& clock) {
    if (settings.kind == "none") return nullptr;
    for (const Kind& kind : kinds)
        if (settings.kind == kind.name) return kind.make(settings, clock);
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
