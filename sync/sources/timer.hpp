// SPDX-License-Identifier: Apache-2.0
// Trigger source "timer": absolute schedule of this machine's monotonic clock.
#pragma once

#include "sync/source_kind.hpp"

namespace obscura::sync {

/// Makes a TimerTrigger.
class TimerKind final : public SourceKindOf<TimerKind> {
public:
    static constexpr SourceTraits description{.name = "timer",
                                              .help = "absolute schedule of this machine",
                                              .group = SourceGroup::schedule,
                                              .uses_rate = true};

    [[nodiscard]] std::unique_ptr<TriggerSource> make(const TriggerLineSettings& line, const Clock& clock,
                                                      const ThreadSettings& thread) const override;

    bool operator==(const TimerKind&) const = default;
};

} // namespace obscura::sync
