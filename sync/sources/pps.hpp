// SPDX-License-Identifier: Apache-2.0
// Trigger source "pps": schedule synchronised to a pulse-per-second device.
#pragma once

#include "sync/source_kind.hpp"

namespace obscura::sync {

/// Makes a PpsTrigger.
class PpsKind final : public SourceKindOf<PpsKind> {
public:
    static constexpr SourceTraits description{.name = "pps",
                                              .help = "schedule in step with a pulse per second",
                                              .uses_rate = true,
                                              .device = "/dev/pps0"};

    [[nodiscard]] std::unique_ptr<TriggerSource> make(const TriggerLineSettings& line, const Clock& clock,
                                                      const ThreadSettings& thread) const override;

    bool operator==(const PpsKind&) const = default;
};

} // namespace obscura::sync
