// SPDX-License-Identifier: Apache-2.0
// Readiness checks of /readyz: whether every daemon answers and each of its cameras does what it should.
#pragma once

#include "web/live/daemon_watch.hpp"

#include <nlohmann/json.hpp>

namespace obscura::web {

struct Readiness {
    bool ready = false;
    nlohmann::ordered_json checks; ///< texts by what was looked at
};

/// Readiness by what daemons said last. Not ready: no daemon answers, or one that runs does not; a supervised
/// thread has been silent for five seconds; the verdict on a camera is bad, its clock has lost its reference,
/// or its files cannot be written. Throws an exception of JSON where that is of another version.
[[nodiscard]] Readiness readiness_of(const Sighting& sighting);

} // namespace obscura::web
