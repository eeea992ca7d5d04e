// SPDX-License-Identifier: Apache-2.0
// Checks of an input file before a library opens it by its name.
#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <mutex>
#include <set>
#include <vector>

namespace obscura {

/// Lists the files that readers open while it lives, on any thread; one at a time in a process. Readers that
/// do not open their file by the functions below call note_input().
class InputRecord {
public:
    InputRecord();
    ~InputRecord();
    InputRecord(const InputRecord&) = delete;
    InputRecord& operator=(const InputRecord&) = delete;
    /// Absolute paths without links, sorted.
    [[nodiscard]] std::vector<std::filesystem::path> files() const;

private:
    friend void note_input(const std::filesystem::path& file);
    mutable std::mutex mutex_;
    std::set<std::filesystem::path> files_;
};
/// Adds `file` to the record, if there is one. Thread-safe.
void note_input(const std::filesystem::path& file);

/// Throws InputError unless `file` is a regular file or a link to one: to open a pipe can block, and to open
/// a device can do more than open it.
void require_regular_file(const std::filesystem::path& file);

struct CloseFile {
    void operator()(std::FILE* file) const noexcept { std::fclose(file); }
};
using InputFile = std::unique_ptr<std::FILE, CloseFile>;
/// Opens a file that passes require_regular_file() for reading. Throws InputError.
[[nodiscard]] InputFile open_input(const std::filesystem::path& file);

/// Throws InputError with exit_no_permission if this process may not read `file` or enter a folder above it;
/// other causes are left to what opens it, as a library that says nothing of errno.
void require_permission(const std::filesystem::path& file);

/// Whether `file` is a regular file that begins as FITS does. CFITSIO would decompress a file of gzip or
/// compress in memory, without limit, before it looks at the header. Throws as require_permission().
[[nodiscard]] bool is_plain_fits(const std::filesystem::path& file);

} // namespace obscura
