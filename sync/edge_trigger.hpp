// SPDX-License-Identifier: Apache-2.0
// Trigger source on an EdgeInput, which it reopens after the input has vanished.
#pragma once

#include "core/clock.hpp"
#include "core/realtime/realtime.hpp"
#include "sync/edge_input.hpp"
#include "sync/sync.hpp"

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>

namespace obscura::sync {

struct EdgeTriggerSettings {
    std::string name = "edge";
    ThreadSettings thread{};
    /// Longest wait, so that stop() and a vanished input are noticed.
    std::int64_t poll_ns = 100 * ns_per_ms;
    std::int64_t reopen_every_ns = 200 * ns_per_ms;
    /// Nominal period of the edges; the state is free after an interval of more than 1.5 periods. 0: always
    /// free.
    std::int64_t nominal_period_ns = 0;
};

/// Ids count the edges from 1 at start(); where the input has sequence numbers, lost edges leave a gap. Edges
/// while the input is gone cannot be counted: numbering continues without a gap when it is back.
class EdgeTrigger final : public TriggerSource {
public:
    using Open = std::function<std::unique_ptr<EdgeInput>()>;

    /// `open` throws HardwareError when the input cannot be opened; start() lets it propagate, the thread
    /// retries. `clock` must outlive the source.
    EdgeTrigger(EdgeTriggerSettings settings, Open open, const Clock& clock);
    ~EdgeTrigger() override;

    [[nodiscard]] std::string_view name() const override { return settings_.name; }
    void start(TriggerSink& sink) override;
    void stop() override;
    [[nodiscard]] Heartbeats heartbeats() const override { return {&heartbeat_}; }

    /// Locked while edges come at their nominal period; there is no holdover.
    [[nodiscard]] ClockState clock_state(Time now) const noexcept override;
    /// False while the input is gone. Thread-safe.
    [[nodiscard]] bool connected() const noexcept { return connected_.load(std::memory_order_relaxed); }
    [[nodiscard]] std::uint64_t refused() const noexcept override {
        return refused_.load(std::memory_order_relaxed);
    }
    [[nodiscard]] std::uint64_t reconnects() const noexcept {
        return reconnects_.load(std::memory_order_relaxed);
    }

private:
    void run(TriggerSink& sink);
    void reopen();
    [[nodiscard]] bool punctual(std::int64_t since_ns) const noexcept;

    const EdgeTriggerSettings settings_;
    const Open open_;
    const Clock& clock_;
    std::unique_ptr<EdgeInput> input_;
    std::atomic<bool> stopping_{false}, connected_{false};
    std::atomic<std::uint64_t> reconnects_{0}, refused_{0};
    std::atomic<std::int64_t> last_edge_ns_{INT64_MIN};
    std::atomic<bool> regular_{false}; ///< the last edge came within 1.5 nominal periods
    Heartbeat heartbeat_;
    std::thread thread_;
};

} // namespace obscura::sync
