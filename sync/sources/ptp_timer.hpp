// SPDX-License-Identifier: Apache-2.0
// Trigger source "ptp_timer": absolute schedule of a PTP hardware clock.
#pragma once

#include "sync/source_kind.hpp"

#include <string>

namespace obscura::sync {

/// Makes a PtpTimer.
class PtpTimerKind final : public SourceKindOf<PtpTimerKind> {
public:
    static constexpr SourceTraits description{.name = "ptp_timer",
                                              .help = "absolute schedule of a PTP clock",
                                              .group = SourceGroup::schedule,
                                              .uses_rate = true,
                                              .device = "/dev/ptp0"};

    std::string start; ///< seconds of the PTP clock; empty: its next full second

    [[nodiscard]] config::Keys keys() override;
    void check(const TriggerLineSettings& line, const Refuse& refuse) const override;
    [[nodiscard]] std::unique_ptr<TriggerSource> make(const TriggerLineSettings& line, const Clock& clock,
                                                      const ThreadSettings& thread) const override;

    bool operator==(const PtpTimerKind&) const = default;
};

} // namespace obscura::sync
