// SPDX-License-Identifier: Apache-2.0
// Outcomes of trigger edges: a ring of records that any number of threads may wait for.
#pragma once

#include "core/realtime/event_count.hpp"
#include "core/text/enum_names.hpp"
#include "core/time.hpp"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace obscura::emulator {

/// What became of a trigger edge.
enum class FrameOutcome : std::uint8_t {
    complete,  ///< every row left in time
    late,      ///< every row left, but at least one was not ready in time
    repeated,  ///< completed with rows of the frame before
    partial,   ///< given up at the first late row
    dropped,   ///< given up for a late row, or there was no room for it
    abandoned, ///< given up for another reason
    missed,    ///< no frame
};
constexpr auto enum_names(FrameOutcome /*type*/) {
    return std::array{
        EnumName{FrameOutcome::complete, "complete"}, EnumName{FrameOutcome::late, "late"},
        EnumName{FrameOutcome::repeated, "repeated"}, EnumName{FrameOutcome::partial, "partial"},
        EnumName{FrameOutcome::dropped, "dropped"},   EnumName{FrameOutcome::abandoned, "abandoned"},
        EnumName{FrameOutcome::missed, "missed"}};
}

/// Record of one edge that has come to its end.
struct OutcomeRecord {
    std::uint64_t frame_id = 0; ///< 0: missed
    std::uint64_t trigger_id = 0;
    std::uint64_t request = 0;     ///< sync::Trigger::request
    std::uint32_t acquisition = 0; ///< number of the acquisition whose frame was made last
    std::uint32_t late_rows = 0, stalled_rows = 0;
    std::uint32_t flags = 0; ///< reported_flags()
    FrameOutcome outcome = FrameOutcome::missed;
};

/// The newest records. All members are thread-safe; publish() is real-time safe.
class OutcomeRing {
public:
    static constexpr std::uint64_t record_count = 1024;

    /// A caller's wait for the record of its edge.
    struct Request {
        std::uint64_t number = 0; ///< for sync::Trigger::request
        std::uint64_t next = 0;   ///< number of the record that is looked at next
    };

    /// Begins a wait. Before the edge, whose record may come at once.
    [[nodiscard]] Request request() noexcept;
    void publish(const OutcomeRecord& record) noexcept;
    /// The record of the request, or none if it has not come by `deadline` (CLOCK_MONOTONIC) or a wake_all().
    [[nodiscard]] std::optional<OutcomeRecord> wait(Request& request, Time deadline) noexcept;
    /// Makes all wait() return.
    void wake_all() noexcept;

private:
    enum Word : std::size_t {
        frame_id,
        trigger_id,
        request_number,
        acquisition_flags,
        rows,
        outcome,
        word_count
    };
    /// `sequence` is odd while the record is written, and 2 * (its number + 1) afterwards.
    struct Slot {
        std::atomic<std::uint64_t> sequence{0};
        std::array<std::atomic<std::uint64_t>, word_count> words{};
    };
    [[nodiscard]] std::optional<OutcomeRecord> find(Request& request) const noexcept;

    std::array<Slot, record_count> slots_{};
    std::atomic<std::uint64_t> published_{0}, requests_{0}, wakes_{0};
    EventCount changed_;
};

} // namespace obscura::emulator
