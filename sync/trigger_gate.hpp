// SPDX-License-Identifier: Apache-2.0
// Trigger gate: decides which edges become frames, by arming, one frame at a time, and the over-trigger
// policy.
#pragma once

#include "core/camera/camera_counters.hpp"
#include "sync/over_trigger.hpp"
#include "sync/sync.hpp"

#include <array>
#include <atomic>
#include <cstdint>

namespace obscura::sync {

/// Notified of missed edges, on any thread: must not block, allocate, lock or throw.
class MissedListener {
public:
    virtual ~MissedListener() = default;
    /// An edge at `edge` was missed, or edges before the one at `edge` were lost.
    virtual void on_missed(Time edge) noexcept = 0;
    /// This edge becomes no frame: missed or masked; ignored or skipped, if someone waits for its outcome.
    virtual void on_refused(const Trigger& /*trigger*/) noexcept {}
};

/// Counters of a gate. edges + lost == taken + missed + masked, except while an edge is latched; `ignored` is
/// not part of the sum.
struct GateCounters {
    std::uint64_t edges = 0;   ///< offered by the selected input while the gate was open
    std::uint64_t lost = 0;    ///< gaps in the ids of an input while it was selected
    std::uint64_t taken = 0;   ///< accepted and handed to the consumer
    std::uint64_t missed = 0;  ///< lost edges, and edges that came too early: sum of missed_because
    std::uint64_t masked = 0;  ///< edges that came too early under OverTrigger::ignore
    std::uint64_t latched = 0; ///< taken edges that had to wait
    std::uint64_t ignored = 0; ///< offered while closed or from another input
    MissedCounts missed_because{};
};

/// Hand-over slot for one trigger between any number of source threads and one consumer thread. offer() is
/// thread-safe and real-time safe. One control thread opens, closes and selects.
class TriggerGate {
public:
    static constexpr std::size_t input_count = 12;

    explicit TriggerGate(OverTrigger policy = OverTrigger::count) : policy_(policy) {}

    // Control side.

    /// Call before the first open(); `listener` must outlive the gate's use.
    void set_missed_listener(MissedListener* listener) noexcept { listener_ = listener; }
    /// Sets the policy for later edges.
    void set_policy(OverTrigger policy) noexcept { policy_.store(policy, std::memory_order_relaxed); }
    /// Opens the gate for edges of the selected input. Waits until the consumer has started an edge taken
    /// before.
    void open() noexcept;
    /// Closes the gate. After the return no edge is taken; a latched edge counts as missed. Waits until the
    /// consumer has started the taken trigger and, with `and_finished`, until it has finished.
    void close(bool and_finished) noexcept;
    void select(std::size_t input) noexcept;
    /// Makes all later wait() return false.
    void quit() noexcept;

    [[nodiscard]] bool is_open() const noexcept;
    /// Whether the gate is open and the consumer free: the next edge is taken unless it comes too early.
    [[nodiscard]] bool ready() const noexcept;
    /// Whether a trigger with its edge at `t` would be taken now.
    [[nodiscard]] bool ready_for(Time t) const noexcept;
    /// Number of the selected input.
    [[nodiscard]] std::size_t selected() const noexcept { return selected_.load(std::memory_order_relaxed); }
    /// Edges before this instant come too early; far in the past when there is no such limit.
    [[nodiscard]] Time not_before() const noexcept {
        return Time{not_before_ns_.load(std::memory_order_relaxed)};
    }
    [[nodiscard]] bool busy() const noexcept;
    [[nodiscard]] GateCounters counters() const noexcept;

    // Source side.

    /// Offers an edge. Returns true when it was taken or latched.
    bool offer(const Trigger& trigger, std::size_t input) noexcept;

    /// Counts an edge that the caller knows to come too early as missed; only while the gate is open.
    void miss(const Trigger& trigger) noexcept;

    // Consumer side, in this order: wait(), current(), perhaps end_acquisition(), started() or not,
    // finished().

    /// Blocks until a trigger is taken; returns false after quit().
    bool wait() noexcept;
    /// Whether a trigger is taken and not started; does not block.
    [[nodiscard]] bool pending() const noexcept;
    [[nodiscard]] const Trigger& current() const noexcept { return slot_; }
    /// Delay from the edge of the current trigger until it can take effect, if it was latched; else 0.
    [[nodiscard]] std::int64_t held_ns() const noexcept { return held_ns_; }
    /// Makes the gate close after the current trigger.
    void close_after_this() noexcept;
    /// Reports that work on the current trigger has begun; edges before `not_before` come too early from now
    /// on.
    void started(Time not_before) noexcept;
    /// Reports that the consumer is free again.
    void finished() noexcept;

private:
    // The state word: phase of the hand-over, open or not, end.
    static constexpr std::uint32_t phase_ready = 0;
    static constexpr std::uint32_t phase_writing = 1; ///< an edge is being written into the slot
    static constexpr std::uint32_t phase_full = 2;    ///< taken, not started
    static constexpr std::uint32_t phase_working = 3;
    static constexpr std::uint32_t phase_mask = 3;
    static constexpr std::uint32_t open_bit = 4;
    static constexpr std::uint32_t quit_bit = 8;
    enum Latch : std::uint32_t { latch_empty, latch_writing, latch_full };

    void count_missed(std::uint64_t edges, Time edge, MissedReason reason) noexcept;
    void count_lost(const Trigger& trigger, std::size_t input) noexcept;
    void miss(const Trigger& trigger, MissedReason reason) noexcept;
    void tell_refused(const Trigger& trigger) noexcept;
    bool try_take(const Trigger& trigger, std::int64_t held_ns) noexcept;
    bool refuse(const Trigger& trigger) noexcept;
    void promote_latched() noexcept;
    bool discard_latched() noexcept;
    void change_phase(std::uint32_t from, std::uint32_t to) noexcept;
    void wait_while(std::uint32_t phases) const noexcept;

    std::atomic<OverTrigger> policy_;
    MissedListener* listener_ = nullptr;
    std::atomic<std::uint32_t> state_{phase_ready};
    std::atomic<std::size_t> selected_{0};
    Trigger slot_;
    std::int64_t held_ns_ = 0;
    std::atomic<std::uint32_t> latch_{latch_empty};
    Trigger latched_trigger_;
    std::atomic<std::int64_t> not_before_ns_{INT64_MIN};
    std::array<std::atomic<std::uint64_t>, input_count> last_id_{}; ///< 0: no predecessor
    std::atomic<std::uint64_t> edges_{0}, lost_{0}, taken_{0}, masked_{0}, latched_{0}, ignored_{0};
    std::array<std::atomic<std::uint64_t>, missed_reason_count> missed_{};
};

} // namespace obscura::sync
