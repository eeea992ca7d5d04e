// Trigger gate: decides which edges become frames, by arming, one frame at a time, and the over-trigger
// policy.
#pragma once

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
    /// An edge at `edge` was missed, or some were lost before the one at `edge`.
    virtual void on_missed(Time edge) noexcept = 0;
};

/// edges + lost == taken + missed + masked, but for an edge that waits latched; `ignored` stands apart.
struct GateCounters {
    std::uint64_t edges = 0;   ///< offered while open and from the chosen input
    std::uint64_t lost = 0;    ///< gaps in an input's ids while it was the chosen one
    std::uint64_t taken = 0;   ///< became work for the consumer
    std::uint64_t missed = 0;  ///< lost ones, and those that came too soon
    std::uint64_t masked = 0;  ///< came too soon under OverTrigger::ignore
    std::uint64_t latched = 0; ///< of the taken: had to wait
    std::uint64_t ignored = 0; ///< offered while closed or from another input
};

/// A hand-over of triggers from any number of source threads to one consumer thread, with room for one.
/// offer() never blocks, allocates or locks. One control thread opens, closes and selects.
class TriggerGate {
public:
    static constexpr std::size_t input_count = 12;

    explicit TriggerGate(OverTrigger policy = OverTrigger::count) : policy_(policy) {}

    // Control side.

    /// Before the first open(); `listener` must outlive the gate's use.
    void set_missed_listener(MissedListener* listener) noexcept { listener_ = listener; }
    /// From now on.
    void set_policy(OverTrigger policy) noexcept { policy_.store(policy, std::memory_order_relaxed); }
    /// Lets edges of the selected input through. Waits until an edge taken before is no longer new.
    void open() noexcept;
    /// After the return no edge is taken; a latched one is missed. Also waits until the consumer has started
    /// what was taken and, with `and_finished`, until it has finished.
    void close(bool and_finished) noexcept;
    void select(std::size_t input) noexcept;
    /// Makes wait() return false for ever.
    void quit() noexcept;

    [[nodiscard]] bool is_open() const noexcept;
    /// Open, and the next edge would be taken if its time is right.
    [[nodiscard]] bool ready() const noexcept;
    /// Whether a trigger with its edge at `t` would be taken now.
    [[nodiscard]] bool ready_for(Time t) const noexcept;
    /// Number of the input that is listened to.
    [[nodiscard]] std::size_t selected() const noexcept { return selected_.load(std::memory_order_relaxed); }
    /// Edges before this are too soon; long ago when none is.
    [[nodiscard]] Time not_before() const noexcept {
        return Time{not_before_ns_.load(std::memory_order_relaxed)};
    }
    [[nodiscard]] bool busy() const noexcept;
    [[nodiscard]] GateCounters counters() const noexcept;

    // Source side.

    /// True when the edge was taken or latched.
    bool offer(const Trigger& trigger, std::size_t input) noexcept;

    /// Counts an edge as missed that the caller knows to come too soon; only while open.
    void miss(const Trigger& trigger) noexcept;

    // Consumer side, in this order: wait(), current(), perhaps end_acquisition(), started() or not,
    // finished().

    /// Blocks until there is a trigger; false after quit().
    bool wait() noexcept;
    /// Without blocking: whether a trigger is there now.
    [[nodiscard]] bool pending() const noexcept;
    [[nodiscard]] const Trigger& current() const noexcept { return slot_; }
    /// How long after its edge the current trigger can take effect, because it was latched; else 0.
    [[nodiscard]] std::int64_t held_ns() const noexcept { return held_ns_; }
    /// The gate closes by itself after the current trigger.
    void close_after_this() noexcept;
    /// Work on the current trigger has begun; edges before `not_before` are too soon from now on.
    void started(Time not_before) noexcept;
    /// The consumer is free again.
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

    void count_missed(std::uint64_t edges, Time edge) noexcept;
    void count_lost(const Trigger& trigger, std::size_t input) noexcept;
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
    std::atomic<std::uint64_t> edges_{0}, lost_{0}, taken_{0}, missed_{0}, masked_{0}, latched_{0},
        ignored_{0};
};

} // namespace obscura::sync
