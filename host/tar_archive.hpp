// SPDX-License-Identifier: Apache-2.0
// Archive of text files as .tar.zst.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace obscura::host {

/// POSIX ustar archive of small files, compressed with zstd. Kept in memory until write(). Thread-bound.
class TarArchive {
public:
    /// `folder`: of all files; `time_s`: their time of change, seconds since 1970.
    TarArchive(std::string folder, std::int64_t time_s) : folder_(std::move(folder)), time_s_(time_s) {}

    /// Appends a file, which only its owner may read. `name` with the folder has at most 100 bytes.
    void add(std::string_view name, std::string_view text);
    /// The whole archive, compressed. Throws std::runtime_error.
    [[nodiscard]] std::string packed() const;
    /// Writes the file, which appears whole, for its owner only. Throws OutputError.
    void write(const std::filesystem::path& file) const;

private:
    std::string folder_;
    std::int64_t time_s_;
    std::string bytes_;
};

} // namespace obscura::host
