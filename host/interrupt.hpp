// SPDX-License-Identifier: Apache-2.0
// Orderly end of a verb on SIGINT or SIGTERM: it stops, reports its results so far and exits.
#pragma once

namespace obscura::host {

/// Installs handlers of SIGINT and SIGTERM; a second signal ends the process by default action.
void catch_interrupts();

/// True after the first signal. Thread-safe.
[[nodiscard]] bool interrupted() noexcept;

} // namespace obscura::host
