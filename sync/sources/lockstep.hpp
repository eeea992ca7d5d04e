// SPDX-License-Identifier: Apache-2.0
// Trigger source "lockstep": steps of a simulator, fired by the simulator port.
#pragma once

#include "sync/source_kind.hpp"

namespace obscura::sync {

/// Makes a SoftwareTrigger, which the simulator port fires.
class LockstepKind final : public SourceKindOf<LockstepKind> {
public:
    static constexpr SourceTraits description{
        .name = "lockstep", .help = "steps of a simulator", .group = SourceGroup::simulator};

    [[nodiscard]] std::unique_ptr<TriggerSource> make(const TriggerLineSettings& line, const Clock& clock,
                                                      const ThreadSettings& thread) const override;

    bool operator==(const LockstepKind&) const = default;
};

} // namespace obscura::sync
