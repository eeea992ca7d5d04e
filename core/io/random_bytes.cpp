// SPDX-License-Identifier: Apache-2.0
#include "core/io/random_bytes.hpp"

#include "core/error.hpp"

#include <fmt/format.h>
#include <sys/random.h>

#include <cerrno>
#include <cstring>

namespace obscura {

void fill_with_random_bytes(std::span<std::byte> bytes) {
    if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
        throw HardwareError(fmt::format("getrandom: {}", std::strerror(errno)));
}

} // namespace obscura
