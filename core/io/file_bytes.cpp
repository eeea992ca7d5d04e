// SPDX-License-Identifier: Apache-2.0
#include "core/io/file_bytes.hpp"

#include "core/error.hpp"
#include "core/io/file_descriptor.hpp"
#include "core/io/input_file.hpp"
#include "core/io/memory_budget.hpp"
#include "core/io/stop_reading.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace obscura {

FileBytes read_file_bytes(const std::filesystem::path& file) {
    require_regular_file(file);
    const FileDescriptor in(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
    struct stat status {};
    if (!in || ::fstat(in.get(), &status) != 0)
        throw InputError(fmt::format("{}: cannot be opened: {}", file.string(), std::strerror(errno)), errno);
    const auto size = static_cast<std::size_t>(status.st_size);
    require_memory(size, file.string());
    const std::shared_ptr<std::byte[]> bytes(new std::byte[size]);
    constexpr std::size_t part = std::size_t{16} << 20;
    for (std::size_t at = 0; at < size;) {
        check_reading();
        const ssize_t done = ::read(in.get(), bytes.get() + at, std::min(part, size - at));
        if (done < 0 && errno == EINTR) continue;
        if (done < 0)
            throw InputError(fmt::format("{}: cannot be read: {}", file.string(), std::strerror(errno)),
                             errno);
        if (done == 0)
            throw InputError(
                fmt::format("{}: was cut to {} of {} bytes while it was read", file.string(), at, size));
        at += static_cast<std::size_t>(done);
    }
    return {bytes, size};
}

} // namespace obscura
