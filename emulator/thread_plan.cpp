// SPDX-License-Identifier: Apache-2.0
#include "emulator/thread_plan.hpp"

#include "core/error.hpp"
#include "core/log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>
#include <utility>

namespace obscura::emulator {
namespace {

// Threads of the plan by their names in [threads].
std::array<std::pair<const char*, ThreadSettings*>, 7> parts_of(ThreadPlan& plan) {
    return {{{"trigger", &plan.trigger},
             {"pipeline", &plan.pipeline},
             {"detector", &plan.detector},
             {"release", &plan.release},
             {"transmit", &plan.transmit},
             {"display", &plan.display},
             {"render", &plan.render}}};
}

void reduce_cores(ThreadPlan& plan, bool required) {
    const CoreSet permitted = permitted_cores();
    for (auto& [name, thread] : parts_of(plan)) {
        if ((thread->cores & ~permitted).none()) continue;
        const std::string text =
            fmt::format("threads.{}_cores: {} are not all available, this process may use {}", name,
                        cores_text(thread->cores), cores_text(permitted));
        if (required) throw HardwareError(text + "; daemon.realtime is \"required\"");
        thread->cores &= permitted;
        log_warning("{}; the thread goes to {}", text, cores_text(thread->cores));
    }
}

} // namespace

ThreadPlan configured_threads(const emulator::DaemonConfig& config) {
    const emulator::ThreadsSection& s = config.threads;
    const auto cores = [](const std::string& text) { return parse_cores(text).value_or(CoreSet{}); };
    return {{s.trigger_priority, cores(s.trigger_cores)},
            {s.pipeline_priority, cores(s.pipeline_cores)},
            {s.detector_priority, cores(s.detector_cores)},
            {s.release_priority, cores(s.release_cores)},
            {s.transmit_priority, cores(s.transmit_cores)},
            {s.display_priority, cores(s.display_cores)},
            {0, cores(s.render_cores)}};
}

int highest_priority(const ThreadPlan& plan) noexcept {
    const int control = plan.transmit.priority > 0 ? plan.transmit.priority + 1 : 0;
    return std::max({plan.trigger.priority, plan.pipeline.priority, plan.detector.priority,
                     plan.release.priority, control, plan.display.priority});
}

ThreadPlan granted_threads(const emulator::DaemonConfig& config) {
    const RealtimeMode wish = config.daemon.realtime;
    ThreadPlan plan = configured_threads(config);
    reduce_cores(plan, wish == RealtimeMode::required);
    const int highest = highest_priority(plan);
    const auto ordinary = [&plan] {
        for (auto& [name, thread] : parts_of(plan))
            thread->priority = 0;
        return plan;
    };
    if (wish == RealtimeMode::off) {
        log_info("real time: off, as configured; deadlines are met as well as ordinary scheduling allows");
        return ordinary();
    }
    if (highest == 0) {
        log_info("real time: no thread has a priority in [threads]; ordinary scheduling");
        return plan;
    }
    const RealtimeGrant grant = realtime_permitted(highest);
    if (grant.granted) return plan;
    if (wish == RealtimeMode::required)
        throw HardwareError(fmt::format(
            "daemon.realtime: \"required\", but {}; allowed with \"auto\", CAP_SYS_NICE or LimitRTPRIO >= {}",
            grant.why, highest));
    log_warning(
        "real time: not permitted ({}); running with ordinary scheduling, expect late frames on a busy "
        "machine",
        grant.why);
    return ordinary();
}

PinnedHere::PinnedHere(const CoreSet& cores) {
    if (cores.none()) return;
    before_ = permitted_cores();
    pin_this_thread(cores);
}

PinnedHere::~PinnedHere() {
    pin_this_thread(before_);
}

} // namespace obscura::emulator
