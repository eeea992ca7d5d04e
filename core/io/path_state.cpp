// SPDX-License-Identifier: Apache-2.0
#include "core/io/path_state.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace obscura {
namespace {

std::filesystem::path checked_path(const std::filesystem::path& path, const std::filesystem::path& found,
                                   const std::error_code& error) {
    if (error) throw InputError(fmt::format("{}: {}", path.string(), error.message()), error.value());
    return found;
}

} // namespace

bool path_exists(const std::filesystem::path& path) noexcept {
    std::error_code ignored;
    return std::filesystem::exists(path, ignored);
}

bool is_file_at(const std::filesystem::path& path) noexcept {
    std::error_code ignored;
    return std::filesystem::is_regular_file(path, ignored);
}

bool is_folder_at(const std::filesystem::path& path) noexcept {
    std::error_code ignored;
    return std::filesystem::is_directory(path, ignored);
}

std::uintmax_t file_bytes_at(const std::filesystem::path& path) noexcept {
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(path, error);
    return error ? 0 : bytes;
}

std::filesystem::path absolute_path(const std::filesystem::path& path) {
    std::error_code error;
    const std::filesystem::path found = std::filesystem::absolute(path, error);
    return checked_path(path, found.lexically_normal(), error);
}

std::filesystem::path real_path(const std::filesystem::path& path) {
    std::error_code error;
    const std::filesystem::path found = std::filesystem::canonical(path, error);
    return checked_path(path, found, error);
}

std::filesystem::path temporary_files_folder() {
    std::error_code error;
    std::filesystem::path folder = std::filesystem::temp_directory_path(error);
    if (error)
        throw OutputError(fmt::format("folder for temporary files (TMPDIR): {}", error.message()),
                          error.value());
    return folder;
}

std::vector<std::filesystem::path> paths_in(const std::filesystem::path& folder, std::error_code& error) {
    std::vector<std::filesystem::path> paths;
    for (std::filesystem::directory_iterator each(folder, error), end; !error && each != end;
         each.increment(error))
        paths.push_back(each->path());
    std::sort(paths.begin(), paths.end());
    return paths;
}

} // namespace obscura
