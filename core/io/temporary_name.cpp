// SPDX-License-Identifier: Apache-2.0
#include "core/io/temporary_name.hpp"

#include "core/io/path_state.hpp"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <charconv>
#include <string>
#include <string_view>
#include <system_error>

namespace obscura {
namespace {

constexpr std::string_view ending = ".tmp";

/// Begin of the names beside `target`; a long name is cut, since a name has at most 255 bytes.
std::string begin_beside(const std::filesystem::path& target) {
    constexpr std::size_t max_bytes = 200;
    return fmt::format(".{}.", target.filename().string().substr(0, max_bytes));
}

/// Process of the temporary file `name`; 0: it is none.
pid_t process_of_temporary(std::string_view name, std::string_view begin) {
    if (!name.starts_with(begin) || !name.ends_with(ending)) return 0;
    name.remove_prefix(begin.size());
    pid_t process = 0;
    const auto [stop, error] = std::from_chars(name.data(), name.data() + name.size(), process);
    return error == std::errc{} && *stop == '.' ? process : 0;
}

} // namespace

std::filesystem::path temporary_beside(const std::filesystem::path& target) {
    static std::atomic<unsigned> counter{0};
    return target.parent_path() /
           fmt::format("{}{}.{}{}", begin_beside(target), ::getpid(), counter.fetch_add(1), ending);
}

void remove_left_temporaries(const std::filesystem::path& target) {
    std::error_code ignored;
    const std::string begin = begin_beside(target);
    const std::filesystem::path folder = target.has_parent_path() ? target.parent_path() : ".";
    for (const std::filesystem::path& path : paths_in(folder, ignored)) {
        const pid_t process = process_of_temporary(path.filename().native(), begin);
        if (process > 0 && ::kill(process, 0) != 0 && errno == ESRCH) std::filesystem::remove(path, ignored);
    }
}

} // namespace obscura
