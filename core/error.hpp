// SPDX-License-Identifier: Apache-2.0
// Set-up error classes and their exit statuses.
#pragma once

#include <stdexcept>
#include <string>

namespace obscura {

/// Exit statuses of every program, after sysexits.h.
enum ExitStatus : int {
    exit_ok = 0,
    exit_failure = 1,   ///< the run did not do what was asked (frames lost, test failed)
    exit_usage = 64,    ///< bad command line
    exit_no_input = 66, ///< an input file cannot be opened or understood
    exit_hardware = 69, ///< interface, port or device not available
    exit_software = 70, ///< a bug
    exit_io = 74,       ///< an output cannot be written
    exit_config = 78,   ///< bad configuration
};

/// A set-up error with its exit status. what() is one complete line that names file, place, cause and what is
/// allowed; main() prints it and exits. Never thrown on a real-time thread.
class Error : public std::runtime_error {
public:
    Error(ExitStatus status, const std::string& line) : std::runtime_error(line), status_(status) {}
    [[nodiscard]] ExitStatus status() const noexcept { return status_; }

private:
    ExitStatus status_;
};

/// Invalid configuration or scene: exit 78.
class ConfigError : public Error {
public:
    explicit ConfigError(const std::string& line) : Error(exit_config, line) {}
};

/// Interface, port or device that is missing or not accessible: exit 69.
class HardwareError : public Error {
public:
    explicit HardwareError(const std::string& line) : Error(exit_hardware, line) {}
};

/// An input file (mesh, catalogue, FITS map) that cannot be read or has invalid content: exit 66.
class InputError : public Error {
public:
    explicit InputError(const std::string& line) : Error(exit_no_input, line) {}
};

/// An output that cannot be written: exit 74.
class OutputError : public Error {
public:
    explicit OutputError(const std::string& line) : Error(exit_io, line) {}
};

} // namespace obscura
