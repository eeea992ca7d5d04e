// SPDX-License-Identifier: Apache-2.0
#include "host/standard_output.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <system_error>

namespace obscura::host {
namespace {

[[noreturn]] void refuse(int error) {
    throw OutputError(fmt::format("standard output: cannot be written{}{}", error != 0 ? ": " : "",
                                  error != 0 ? std::strerror(error) : ""));
}

} // namespace

int with_standard_output(const std::function<int()>& program) {
    int status = exit_failure;
    try {
        status = program();
    } catch (const std::system_error& error) { // of fmt::print
        if (std::ferror(stdout) != 0) refuse(error.code().value());
        throw;
    }
    const bool failed_before = std::ferror(stdout) != 0; // its errno is gone
    errno = 0;
    if (std::fflush(stdout) != 0 || failed_before) refuse(errno);
    return status;
}

} // namespace obscura::host
