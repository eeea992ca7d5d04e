// SPDX-License-Identifier: Apache-2.0
#include "emulator/unit/thread_plan.hpp"

#include "core/error.hpp"
#include "core/realtime/log.hpp"

#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <string>
#include <utility>

namespace obscura::emulator {
namespace {

// Threads of the plan besides rendering, by their names in [threads].
std::array<std::pair<const char*, ThreadSettings*>, 6> parts_of(ThreadPlan& plan) {
    return {{{"trigger", &plan.trigger},
             {"pipeline", &plan.pipeline},
             {"detector", &plan.detector},
             {"release", &plan.release},
             {"transmit", &plan.transmit},
             {"display", &plan.display}}};
}

void reduce_cores(const char* name, CoreSet& cores, const CoreSet& permitted, bool required) {
    if ((cores & ~permitted).none()) return;
    const std::string text =
        fmt::format("threads.{}_cores: {} are not all available, this process may use {}", name,
                    cores_text(cores), cores_text(permitted));
    if (required) throw HardwareError(text + "; daemon.realtime is \"required\"");
    cores &= permitted;
    log_warning("{}; the thread goes to {}", text, cores_text(cores));
}

void clear_priorities(ThreadPlan& plan) {
    for (auto& [name, thread] : parts_of(plan))
        thread->priority = 0;
    if (plan.render.has_priority()) plan.render = {.cores = plan.render.cores};
    plan.tiles.priority = 0;
    plan.tiles_share = 1;
}

void grant_priorities(ThreadPlan& plan, bool required) {
    const int highest = highest_priority(plan);
    if (highest == 0) {
        log_info("real time: no thread has a priority in [threads]; ordinary scheduling");
        return;
    }
    const RealtimeGrant grant = realtime_permitted(highest);
    if (grant.granted) return;
    if (required)
        throw HardwareError(fmt::format(
            "daemon.realtime: \"required\", but {}; allowed with \"auto\", CAP_SYS_NICE or LimitRTPRIO >= {}",
            grant.why, highest));
    log_warning(
        "real time: not permitted ({}); running with ordinary scheduling, expect late frames on a busy machine",
        grant.why);
    clear_priorities(plan);
}

void grant_rendering(RenderScheduling& render, bool required) {
    const RealtimeGrant grant = scheduling_permitted(render);
    if (grant.granted) return;
    if (required)
        throw HardwareError(fmt::format(
            "daemon.realtime: "
            "\"required\", but rendering: {}; allowed with \"auto\", CAP_SYS_NICE or LimitNICE={}",
            grant.why, render.nice));
    log_warning("rendering: {}; rendering shares the processors evenly with other programs", grant.why);
    render.nice = 0;
}

// Rendering without cores of its own keeps off those of threads with a priority, if that leaves any.
void separate_rendering(ThreadPlan& plan, const CoreSet& permitted) {
    if (plan.render.cores.none()) plan.render.cores = ordinary_cores(plan, permitted);
    if (plan.pipeline.cores.none() && plan.pipeline.priority == 0) plan.pipeline.cores = plan.render.cores;
}

} // namespace

ThreadPlan configured_threads(const emulator::DaemonConfig& config) {
    const emulator::ThreadsSection& s = config.threads;
    const auto cores = [](const std::string& text) { return parse_cores(text).value_or(CoreSet{}); };
    RenderScheduling render{.policy = s.render_class, .cores = cores(s.render_cores)};
    if (render.has_priority()) {
        render.priority = s.render_priority;
        render.share = s.render_share;
    } else {
        render.nice = s.render_nice;
    }
    ThreadSettings tiles;
    double tiles_share = 1;
    if (render.has_priority() && s.tiles_share > 0) {
        // Workers that render all the time would leave it nothing; above them it must not take much.
        tiles.priority = render.priority + 1;
        tiles_share = s.tiles_share;
    }
    return {{s.trigger_priority, cores(s.trigger_cores)},
            {s.pipeline_priority, cores(s.pipeline_cores)},
            {s.detector_priority, cores(s.detector_cores)},
            {s.release_priority, cores(s.release_cores)},
            {s.transmit_priority, cores(s.transmit_cores)},
            {s.display_priority, cores(s.display_cores)},
            render,
            tiles,
            tiles_share};
}

CoreSet ordinary_cores(const ThreadPlan& plan, const CoreSet& permitted) {
    CoreSet taken;
    for (const ThreadSettings* thread :
         {&plan.trigger, &plan.detector, &plan.release, &plan.transmit, &plan.display})
        if (thread->priority > 0) taken |= thread->cores;
    return taken.any() ? permitted & ~taken : CoreSet{};
}

void enter_client_thread(const char* name, const CoreSet& cores) noexcept {
    constexpr int nice_level = 5;
    name_this_thread(name);
    ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), nice_level);
    pin_this_thread(cores);
}

void enter_idle_thread(const char* name, const CoreSet& cores) noexcept {
    enter_client_thread(name, cores);
    const sched_param none{};
    ::pthread_setschedparam(::pthread_self(), SCHED_IDLE, &none);
}

int highest_priority(const ThreadPlan& plan) noexcept {
    const int control = plan.transmit.priority > 0 ? plan.transmit.priority + 1 : 0;
    return std::max({plan.trigger.priority, plan.pipeline.priority, plan.detector.priority,
                     plan.release.priority, control, plan.display.priority,
                     plan.render.has_priority() ? plan.render.priority : 0, plan.tiles.priority});
}

ThreadPlan granted_threads(const emulator::DaemonConfig& config, const CoreSet& permitted) {
    const bool required = config.daemon.realtime == RealtimeMode::required;
    ThreadPlan plan = configured_threads(config);
    for (auto& [name, thread] : parts_of(plan))
        reduce_cores(name, thread->cores, permitted, required);
    reduce_cores("render", plan.render.cores, permitted, required);
    if (config.daemon.realtime == RealtimeMode::off) {
        log_info("real time: off, as configured; deadlines are met as well as ordinary scheduling allows");
        clear_priorities(plan);
        plan.render = {.cores = plan.render.cores};
    } else {
        grant_priorities(plan, required);
        grant_rendering(plan.render, required);
    }
    // Beside a thread that renders, the pipeline thread only waits and plans: it must not wait for rendering.
    if (config.render.ahead == RenderAhead::automatic && plan.pipeline.priority == 0)
        plan.pipeline.priority = plan.detector.priority;
    separate_rendering(plan, permitted);
    plan.tiles.cores = plan.render.cores;
    return plan;
}

void set_session_nice(int nice) {
    if (nice >= 0 || getsid(0) != getpid()) return;
    // A kernel without autogroups has no such file.
    std::ofstream("/proc/self/autogroup") << nice;
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
