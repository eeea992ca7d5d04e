// SPDX-License-Identifier: Apache-2.0
#include "sync/edge_trigger.hpp"

#include "core/error.hpp"
#include "core/realtime/log.hpp"
#include "core/realtime/realtime.hpp"

#include <array>
#include <chrono>
#include <utility>

namespace obscura::sync {

EdgeTrigger::EdgeTrigger(EdgeTriggerSettings settings, Open open, const Clock& clock)
    : settings_(std::move(settings)),
      open_(std::move(open)),
      clock_(clock),
      heartbeat_("trigger-" + settings_.name) {}

EdgeTrigger::~EdgeTrigger() {
    stop();
}

void EdgeTrigger::start(TriggerSink& sink) {
    stop();
    input_ = open_();
    stopping_ = false;
    connected_ = true;
    refused_ = 0;
    last_edge_ns_ = INT64_MIN;
    thread_ = std::thread([this, &sink] {
        enter_thread(heartbeat_.name().c_str(), settings_.thread);
        run(sink);
    });
}

void EdgeTrigger::stop() {
    if (!thread_.joinable()) return;
    stopping_ = true;
    thread_.join();
    heartbeat_.rest();
    input_.reset();
    connected_ = false;
}

void EdgeTrigger::run(TriggerSink& sink) {
    std::array<Edge, 16> edges;
    std::uint64_t id = 0, last_sequence = 0, refused_before = 0;
    while (!stopping_.load(std::memory_order_relaxed)) {
        heartbeat_.beat();
        if (!input_) {
            reopen();
            last_sequence = 0;
            continue;
        }
        const int count = input_->wait(settings_.poll_ns, edges);
        if (count == EdgeInput::gone) {
            // The thread may log and allocate until the input is back: it has no deadline without edges.
            log_warning("trigger {}: the input has vanished; waiting for it to come back", settings_.name);
            connected_ = false;
            refused_before += input_->refused();
            input_.reset();
            continue;
        }
        refused_.store(refused_before + input_->refused(), std::memory_order_relaxed);
        const Time seen = clock_.now();
        for (int i = 0; i < count; ++i) {
            const Edge& edge = edges[static_cast<std::size_t>(i)];
            const bool known = last_sequence != 0 && edge.sequence > last_sequence;
            id += known ? edge.sequence - last_sequence : 1;
            last_sequence = edge.sequence;
            const std::int64_t last_ns = last_edge_ns_.exchange(edge.at.ns, std::memory_order_relaxed);
            const bool regular = last_ns != INT64_MIN && punctual(edge.at.ns - last_ns);
            regular_.store(regular, std::memory_order_relaxed);
            sink.on_trigger({id, edge.at, seen, regular ? ClockState::locked : ClockState::free,
                             Trigger::scene_of_camera, edge.falling});
        }
    }
}

bool EdgeTrigger::punctual(std::int64_t since_ns) const noexcept {
    return 2 * since_ns <= 3 * settings_.nominal_period_ns;
}

ClockState EdgeTrigger::clock_state(Time now) const noexcept {
    const std::int64_t last_ns = last_edge_ns_.load(std::memory_order_relaxed);
    const bool locked = last_ns != INT64_MIN && connected() && regular_.load(std::memory_order_relaxed) &&
                        punctual(now.ns - last_ns);
    return locked ? ClockState::locked : ClockState::free;
}

void EdgeTrigger::reopen() {
    try {
        input_ = open_();
        connected_ = true;
        reconnects_.fetch_add(1, std::memory_order_relaxed);
        log_notice("trigger {}: the input is back", settings_.name);
    } catch (const Error&) {
        std::this_thread::sleep_for(std::chrono::nanoseconds(settings_.reopen_every_ns));
    }
}

} // namespace obscura::sync
