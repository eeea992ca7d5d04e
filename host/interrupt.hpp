// SPDX-License-Identifier: Apache-2.0
// Orderly end of a verb on SIGINT or SIGTERM: it stops, reports its results so far and exits.
#pragma once

#include <atomic>

namespace obscura::host {

/// Installs handlers of SIGINT and SIGTERM; a second signal ends the process by default action.
void catch_interrupts();

/// True after the first signal. Thread-safe.
[[nodiscard]] bool interrupted() noexcept;

/// What interrupted() reads, for work that is cancelled by a flag. Thread-safe.
[[nodiscard]] const std::atomic<bool>& interrupt_flag() noexcept;

/// Number of the signal that came first; 0: none. Thread-safe.
[[nodiscard]] int interrupt_signal() noexcept;

/// Ends the process by default action of the first signal, so that its status says so. Flushes nothing.
/// Thread-safe.
[[noreturn]] void end_by_interrupt() noexcept;

} // namespace obscura::host
