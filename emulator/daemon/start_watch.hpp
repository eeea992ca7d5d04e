// SPDX-License-Identifier: Apache-2.0
// Watch over the daemon's start: tells the service manager how far it is, and ends it when a signal asks.
#pragma once

#include "emulator/daemon/start_progress.hpp"

#include <atomic>
#include <functional>
#include <thread>

namespace obscura::emulator {

/// Has a thread while it lives, beside the main thread that loads. Thread-bound.
class StartWatch {
public:
    /// `progress` outlives this; `stop_wanted`, thread-safe: a signal that ends the daemon has come. If the
    /// start has not ended by itself soon after that, the process ends here, with status 0: nothing has been
    /// opened yet but sockets that the next start replaces.
    StartWatch(const StartProgress& progress, std::function<bool()> stop_wanted);
    ~StartWatch();
    StartWatch(const StartWatch&) = delete;
    StartWatch& operator=(const StartWatch&) = delete;

private:
    void run();

    const StartProgress& progress_;
    const std::function<bool()> stop_wanted_;
    std::atomic<bool> over_{false};
    std::thread thread_;
};

} // namespace obscura::emulator
