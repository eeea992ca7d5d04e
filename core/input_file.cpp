// SPDX-License-Identifier: Apache-2.0
#include "core/input_file.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <string_view>
#include <system_error>

namespace obscura {

void require_regular_file(const std::filesystem::path& file) {
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(file, error);
    if (!std::filesystem::is_regular_file(status))
        throw InputError(
            fmt::format("{}: cannot be opened: {}", file.string(),
                        std::filesystem::exists(status) ? "not a regular file" : error.message()));
}

InputFile open_input(const std::filesystem::path& file) {
    require_regular_file(file);
    InputFile in(std::fopen(file.c_str(), "rbe"));
    if (!in) throw InputError(fmt::format("{}: cannot be opened: {}", file.string(), std::strerror(errno)));
    return in;
}

bool is_plain_fits(const std::filesystem::path& file) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error)) return false;
    constexpr std::string_view start = "SIMPLE  =";
    std::array<char, start.size()> bytes{};
    return std::ifstream(file, std::ios::binary).read(bytes.data(), bytes.size()) &&
           std::string_view(bytes.data(), bytes.size()) == start;
}

} // namespace obscura
