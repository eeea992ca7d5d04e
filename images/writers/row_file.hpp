// SPDX-License-Identifier: Apache-2.0
// A text file that grows by rows while a program runs, for instance a CSV.
#pragma once

#include "core/io/file_descriptor.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace obscura::images {

/// Holds whole rows at all times, also on a full disk: rows that cannot be written are counted, said once in
/// the log, and a comment `# 12 rows are missing here` stands in their place once there is room again. Not
/// thread-safe, not for real-time threads.
class RowFile {
public:
    /// Creates the file, or empties it. Throws OutputError.
    explicit RowFile(std::filesystem::path file);
    /// Adds a row with its line end; flush() writes it.
    void add(std::string_view row);
    /// Writes the rows that were added. Returns whether none is missing.
    bool flush();
    /// Writes a row with its line end, or throws OutputError with the reason: the file then ends with the row
    /// before.
    void write(std::string_view row);
    /// Rows that could not be written so far.
    [[nodiscard]] std::uint64_t lost_rows() const noexcept { return lost_; }
    [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

private:
    std::filesystem::path path_;
    FileDescriptor file_;
    std::int64_t whole_bytes_ = 0; ///< of the file
    std::string waiting_;          ///< rows that were added
    std::uint64_t waiting_rows_ = 0, lost_ = 0, unmarked_ = 0;
};

} // namespace obscura::images
