// SPDX-License-Identifier: Apache-2.0
// Ends a long reading of files when the program is to stop.
#pragma once

#include "core/error.hpp"

#include <functional>

namespace obscura {

/// Thrown by readers that were stopped. Programs end with it as they do when interrupted.
class ReadingStopped : public Error {
public:
    ReadingStopped() : Error(exit_failure, "stopped while files were read") {}
};

/// While it lives, check_reading() asks `wanted`, on any thread, which must be cheap and thread-safe; one at
/// a time in a process.
class StopReading {
public:
    explicit StopReading(std::function<bool()> wanted);
    ~StopReading();
    StopReading(const StopReading&) = delete;
    StopReading& operator=(const StopReading&) = delete;

private:
    friend void check_reading();
    std::function<bool()> wanted_;
};

/// Throws ReadingStopped if that is wanted. Readers call it several times a second. Not for real-time
/// threads.
void check_reading();

} // namespace obscura
