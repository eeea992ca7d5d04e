// SPDX-License-Identifier: Apache-2.0
#include "core/io/input_file.hpp"

#include "core/error.hpp"
#include "core/io/path_state.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <string_view>
#include <system_error>
#include <utility>

namespace obscura {
namespace {

std::atomic<InputRecord*> input_record{nullptr};

} // namespace

InputRecord::InputRecord() {
    input_record = this;
}
InputRecord::~InputRecord() {
    input_record = nullptr;
}

std::vector<std::filesystem::path> InputRecord::files() const {
    const std::lock_guard lock(mutex_);
    return {files_.begin(), files_.end()};
}

void note_input(const std::filesystem::path& file) {
    InputRecord* const record = input_record;
    if (record == nullptr) return;
    std::error_code error;
    std::filesystem::path whole = std::filesystem::canonical(file, error);
    if (error) return; // the reader says so
    const std::lock_guard lock(record->mutex_);
    record->files_.insert(std::move(whole));
}

void require_regular_file(const std::filesystem::path& file) {
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(file, error);
    if (!std::filesystem::is_regular_file(status))
        throw InputError(
            fmt::format("{}: cannot be opened: {}", file.string(),
                        std::filesystem::exists(status) ? "not a regular file" : error.message()),
            error.value());
    note_input(file);
}

InputFile open_input(const std::filesystem::path& file) {
    require_regular_file(file);
    InputFile in(std::fopen(file.c_str(), "rbe"));
    if (!in)
        throw InputError(fmt::format("{}: cannot be opened: {}", file.string(), std::strerror(errno)), errno);
    return in;
}

void require_permission(const std::filesystem::path& file) {
    if (faccessat(AT_FDCWD, file.c_str(), R_OK, AT_EACCESS) == 0) return;
    if (const int cause = errno; status_of_input(cause) == exit_no_permission)
        throw InputError(fmt::format("{}: cannot be opened: {}", file.string(), std::strerror(cause)), cause);
}

bool is_plain_fits(const std::filesystem::path& file) {
    require_permission(file);
    if (!is_file_at(file)) return false;
    constexpr std::string_view start = "SIMPLE  =";
    note_input(file);
    std::array<char, start.size()> bytes{};
    return std::ifstream(file, std::ios::binary).read(bytes.data(), bytes.size()) &&
           std::string_view(bytes.data(), bytes.size()) == start;
}

} // namespace obscura
