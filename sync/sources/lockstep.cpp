// SPDX-License-Identifier: Apache-2.0
#include "sync/sources/lockstep.hpp"

#include "sync/software.hpp"

namespace obscura::sync {

std::unique_ptr<TriggerSource> LockstepKind::make(const TriggerLineSettings& /*line*/, const Clock& clock,
                                                  const ThreadSettings& /*thread*/) const {
    return std::make_unique<SoftwareTrigger>(clock, description.name);
}

} // namespace obscura::sync
