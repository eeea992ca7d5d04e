// SPDX-License-Identifier: Apache-2.0
// Trigger router under a fake clock: edges in, frame requests out, without frames.
#pragma once

#include "emulator/trigger/trigger_router.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace obscura::test {

inline constexpr std::int64_t ms = ns_per_ms;

/// Alarms that expire when the test says so.
class ManualAlarms final : public emulator::AlarmPort {
public:
    explicit ManualAlarms(Handler handler) : handler_(std::move(handler)) {}
    void stop() noexcept override {}
    void set(std::size_t alarm, Time due) noexcept override { due_[alarm] = due; }
    void clear(std::size_t alarm) noexcept override { due_[alarm].reset(); }
    [[nodiscard]] const Heartbeat& heartbeat() const noexcept override { return heartbeat_; }

    /// Moves `clock` on to the earliest alarm up to `until`, and lets that expire.
    bool expire_next(FakeClock& clock, Time until) {
        const auto earlier = [](const auto& a, const auto& b) { return a && (!b || *a < *b); };
        const auto next = std::min_element(due_.begin(), due_.end(), earlier);
        if (!*next || **next > until) return false;
        const Time due = **next;
        next->reset();
        clock.advance_to(due);
        handler_(static_cast<std::size_t>(next - due_.begin()), due);
        return true;
    }

private:
    const Handler handler_;
    std::array<std::optional<Time>, alarm_count> due_{};
    Heartbeat heartbeat_{"alarm"};
};

/// Router with a single-edge Line0 and Line1, a dual-edge Line2 and Line3, and a pipeline that makes each
/// frame at once, or when the test says so. Frames follow each other after 1 ms at the earliest.
struct RouterFixture : sync::MissedListener {
    explicit RouterFixture(const std::function<void(CameraSettings&)>& adjust,
                           sync::OverTrigger over_trigger = sync::OverTrigger::count)
        : settings(adjusted(adjust)),
          router(
              {{LineEdges{true, false}, LineEdges{true, false}, LineEdges{true, true}, LineEdges{true, true}},
               over_trigger},
              settings, clock, *this, [this](emulator::AlarmPort::Handler handler) {
                  auto made = std::make_unique<ManualAlarms>(std::move(handler));
                  alarms = made.get();
                  return made;
              }) {}

    static CameraSettings adjusted(const std::function<void(CameraSettings&)>& adjust) {
        CameraSettings s;
        if (adjust) adjust(s);
        return s;
    }
    void on_missed(Time edge) noexcept override { missed.push_back(edge); }

    void start() {
        router.acquisition_start(settings, clock.now());
        router.set_frame_period(5 * ms);
        router.resume_level();
    }
    void apply(const std::function<void(CameraSettings&)>& adjust) {
        adjust(settings);
        router.set(settings);
        router.select(settings);
        router.resume_level();
    }
    /// Lets time pass until `t`.
    void run_to(std::int64_t t_ms) {
        while (alarms->expire_next(clock, begin + t_ms * ms))
            serve();
        clock.advance_to(begin + t_ms * ms);
        serve();
    }
    /// An edge of `line` at `t_ms` after the test's begin.
    void edge(std::size_t line, std::int64_t t_ms, bool falling = false) {
        run_to(t_ms);
        sync::Trigger trigger{++ids[line], clock.now(), clock.now()};
        trigger.falling = falling;
        router.line(line).on_trigger(trigger);
        serve();
        run_to(t_ms); // what counters and timers make of it
    }
    void begin_frame() {
        requests.push_back(router.gate().current());
        held_ns.push_back(router.gate().held_ns());
        router.gate().started(requests.back().edge + held_ns.back() + ms);
    }
    void serve() {
        while (!pipeline_held && router.gate().pending()) {
            begin_frame();
            router.gate().finished();
        }
    }
    /// Instants of the frames requested, in ms.
    [[nodiscard]] std::vector<std::int64_t> frames() const {
        std::vector<std::int64_t> t;
        for (const sync::Trigger& request : requests)
            t.push_back((request.edge - begin) / ms);
        return t;
    }
    [[nodiscard]] Time at(std::int64_t t_ms) const { return begin + t_ms * ms; }
    [[nodiscard]] sync::GateCounters counters() const {
        const sync::GateCounters c = router.counters();
        CHECK(c.edges + c.lost == c.taken + c.missed + c.masked);
        CHECK(c.taken == requests.size());
        CHECK(missed.size() <= c.missed);
        return c;
    }

    const Time begin{ns_per_s};
    FakeClock clock{begin};
    CameraSettings settings;
    ManualAlarms* alarms = nullptr;
    std::vector<Time> missed;
    std::vector<sync::Trigger> requests;
    std::vector<std::int64_t> held_ns;
    std::array<std::uint64_t, line_count> ids{};
    bool pipeline_held = false;
    emulator::TriggerRouter router;
};

using Instants = std::vector<std::int64_t>;

} // namespace obscura::test
