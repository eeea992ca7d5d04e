// SPDX-License-Identifier: Apache-2.0
// Watch of a running verb: shows its progress and ends it soon after SIGINT or SIGTERM.
#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace obscura::tools {

/// Beside a verb from its begin to its end. From the second on it shows its progress on standard error: on a
/// terminal as a line that renews itself, elsewhere as a line every few seconds. A verb that has not ended
/// by itself a little after an interrupt (host/interrupt.hpp), wherever it is, is ended: the temporary files
/// of its outputs are removed, and the process ends by the signal. Thread-bound.
class VerbWatch {
public:
    struct Settings {
        std::string verb;
        bool shows_progress = true;
        bool keeps_work = false; ///< see Verb::keeps_work()
        /// Exit status after an interrupt; none: that of the signal.
        std::optional<int> interrupted_status{};
    };
    /// Starts a thread; after catch_interrupts().
    explicit VerbWatch(Settings settings);
    ~VerbWatch();
    VerbWatch(const VerbWatch&) = delete;
    VerbWatch& operator=(const VerbWatch&) = delete;

private:
    void run();
    [[noreturn]] void end() const;

    Settings settings_;
    std::mutex mutex_; // guards over_
    std::condition_variable ended_;
    bool over_ = false;
    std::thread thread_;
};

} // namespace obscura::tools
