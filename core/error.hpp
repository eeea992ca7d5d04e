// SPDX-License-Identifier: Apache-2.0
// Set-up error classes and their exit statuses.
#pragma once

#include <cerrno>
#include <stdexcept>
#include <string>

namespace obscura {

/// Exit statuses of every program, after sysexits.h.
enum ExitStatus : int {
    exit_ok = 0,
    exit_failure = 1,        ///< the run did not do what was asked (frames lost, test failed)
    exit_usage = 64,         ///< bad command line
    exit_no_input = 66,      ///< an input file cannot be opened or understood
    exit_hardware = 69,      ///< interface, port or device not available
    exit_software = 70,      ///< a bug
    exit_no_output = 73,     ///< an output cannot be created: its folder, its name or what stands there
    exit_io = 74,            ///< an output cannot be written, once created
    exit_no_permission = 77, ///< file permissions or a read-only file system are in the way
    exit_config = 78,        ///< bad configuration
};

/// Exit status of a file that cannot be read, by the errno of the call that failed; 0: of what is in it.
[[nodiscard]] constexpr ExitStatus status_of_input(int cause) noexcept {
    return cause == EACCES || cause == EPERM ? exit_no_permission : exit_no_input;
}

/// Exit status of a file or folder that cannot be made or written, by the errno of the call that failed; 0:
/// not known.
[[nodiscard]] constexpr ExitStatus status_of_output(int cause) noexcept {
    switch (cause) {
    case EACCES:
    case EPERM:
    case EROFS:
        return exit_no_permission;
    case ENOENT:
    case ENOTDIR:
    case EISDIR:
    case EEXIST:
    case ENOTEMPTY:
    case ELOOP:
    case ENAMETOOLONG:
    case ENXIO:
    case EXDEV:
    case EINVAL:
    case EILSEQ:
        return exit_no_output;
    default:
        return exit_io;
    }
}

/// A set-up error with its exit status. what() is one complete line that names file, place, cause and what is
/// allowed; main() prints it and exits. Never thrown on a real-time thread.
class Error : public std::runtime_error {
public:
    Error(ExitStatus status, const std::string& line) : std::runtime_error(line), status_(status) {}
    [[nodiscard]] ExitStatus status() const noexcept { return status_; }

private:
    ExitStatus status_;
};

/// Invalid configuration or scene: exit 78; `cause`: errno with which its file could not be read.
class ConfigError : public Error {
public:
    explicit ConfigError(const std::string& line, int cause = 0)
        : Error(cause == 0 ? exit_config : status_of_input(cause), line) {}
};

/// Interface, port or device that is missing or not accessible: exit 69.
class HardwareError : public Error {
public:
    explicit HardwareError(const std::string& line) : Error(exit_hardware, line) {}
};

/// An input file (mesh, catalogue, FITS map) that cannot be read or has invalid content: exit 66, or that
/// of status_of_input(cause).
class InputError : public Error {
public:
    explicit InputError(const std::string& line, int cause = 0) : Error(status_of_input(cause), line) {}
};

/// An output that cannot be written: exit 74, or that of status_of_output(cause).
class OutputError : public Error {
public:
    explicit OutputError(const std::string& line, int cause = 0) : Error(status_of_output(cause), line) {}
};

} // namespace obscura
