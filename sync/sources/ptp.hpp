// SPDX-License-Identifier: Apache-2.0
// Trigger source "ptp": external time stamps of a PTP hardware clock.
#pragma once

#include "sync/source_kind.hpp"

#include <cstdint>

namespace obscura::sync {

/// Makes an EdgeTrigger on an EXTTS channel.
class PtpKind final : public SourceKindOf<PtpKind> {
public:
    static constexpr SourceTraits description{
        .name = "ptp", .help = "edges at a time stamp input of a PTP clock", .device = "/dev/ptp0"};

    std::int32_t channel = 0; ///< EXTTS channel of the device

    [[nodiscard]] config::Keys keys() override;
    [[nodiscard]] std::unique_ptr<TriggerSource> make(const TriggerLineSettings& line, const Clock& clock,
                                                      const ThreadSettings& thread) const override;

    bool operator==(const PtpKind&) const = default;
};

} // namespace obscura::sync
