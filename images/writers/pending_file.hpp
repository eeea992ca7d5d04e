// SPDX-License-Identifier: Apache-2.0
// Atomic file creation: a file appears under its name only when it is complete.
#pragma once

#include "core/error.hpp"

#include <filesystem>
#include <string>
#include <string_view>

namespace obscura::images {

/// Temporary file in the folder of `target`, which commit() renames to `target`. Without commit() the
/// temporary file is removed. Reentrant, not thread-safe: two PendingFiles of one process never share a
/// temporary name.
class PendingFile {
public:
    explicit PendingFile(std::filesystem::path target);
    ~PendingFile();
    PendingFile(const PendingFile&) = delete;
    PendingFile& operator=(const PendingFile&) = delete;

    [[nodiscard]] const std::filesystem::path& path() const noexcept { return temporary_; }
    /// Throws OutputError.
    void commit();
    /// Throws OutputError `target: cannot be written: why`.
    [[noreturn]] void fail(std::string_view why, int cause = 0) const;

private:
    std::filesystem::path target_;
    std::filesystem::path temporary_;
};

/// Removes the temporary files of all PendingFiles, for good: who makes or ends one later waits for ever. For
/// a thread that ends the process next. Thread-safe.
void remove_pending_files() noexcept;

/// Throws OutputError unless `directory` exists and a file can be created in it.
void require_writable(const std::filesystem::path& directory);

/// Creates `directory` and its parents if they do not exist, then checks it by require_writable().
void make_writable(const std::filesystem::path& directory);

} // namespace obscura::images
