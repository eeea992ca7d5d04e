// SPDX-License-Identifier: Apache-2.0
// Trigger conditioning between source and camera: debounce, divider, delay.
#pragma once

#include "sync/sync.hpp"

#include <atomic>
#include <cstdint>

namespace obscura::sync {

struct ConditionerSettings {
    /// Debounce time: an edge earlier than this after the last accepted one is dropped.
    std::int64_t debounce_ns = 0;
    std::uint32_t divider = 1; ///< the first of every `divider` edges passes
    std::int64_t delay_ns = 0; ///< added to the time stamp; the trigger is delivered at once
};

/// Counters of edges by result: edges == passed + divided + bounces.
struct ConditionerCounters {
    std::uint64_t edges = 0;   ///< delivered by the source
    std::uint64_t lost = 0;    ///< gaps in the source's ids
    std::uint64_t bounces = 0; ///< dropped by the debounce filter
    std::uint64_t divided = 0; ///< dropped by the divider
    std::uint64_t passed = 0;  ///< delivered to the next sink
};

/// Filters triggers between a source and the next sink. Edges that the source lost count for the divider, and
/// a lost edge that would have passed leaves a gap in the ids. Real-time safe; thread-bound to the source's
/// thread except for counters().
class Conditioner final : public TriggerSink {
public:
    /// `next` must outlive the conditioner. `settings.divider` is at least 1.
    Conditioner(const ConditionerSettings& settings, TriggerSink& next);

    void on_trigger(const Trigger& trigger) noexcept override;
    [[nodiscard]] ConditionerCounters counters() const noexcept;

private:
    const ConditionerSettings settings_;
    TriggerSink& next_;
    // Source's thread only.
    std::uint64_t last_id_ = 0;  ///< of the source; 0: none yet
    std::uint64_t position_ = 0; ///< number of the next edge, without bounces, with lost edges
    Time last_edge_{INT64_MIN};
    std::atomic<std::uint64_t> edges_{0}, lost_{0}, bounces_{0}, divided_{0}, passed_{0};
};

} // namespace obscura::sync
