// SPDX-License-Identifier: Apache-2.0
#include "sync/source_kind.hpp"

#include "sync/edge_trigger.hpp"
#include "sync/settings.hpp"

namespace obscura::sync {

EdgeTriggerSettings edge_trigger_settings(const TriggerLineSettings& line, const ThreadSettings& thread) {
    return {.name = line.source,
            .thread = thread,
            .nominal_period_ns = static_cast<std::int64_t>(1e9 / line.rate().hz())};
}

} // namespace obscura::sync
