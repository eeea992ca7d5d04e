// ^C and SIGTERM end a verb tidily: what was done so far is reported.
#pragma once

namespace obscura::tools {

/// Catches SIGINT and SIGTERM from now on; a second one ends the process as usual.
void catch_interrupts();

/// True after the first signal. Any thread.
[[nodiscard]] bool interrupted() noexcept;

} // namespace obscura::tools
