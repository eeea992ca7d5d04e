// A file that appears under its name only when it is complete.
#pragma once

#include "core/error.hpp"

#include <filesystem>
#include <string>
#include <string_view>

namespace obscura::images {

/// Hands out a temporary name in the folder of `target`; commit() renames it. Without commit() the temporary
/// file is removed. Not thread-safe; two PendingFiles of one process never share a temporary name.
class PendingFile {
public:
    explicit PendingFile(std::filesystem::path target);
    ~PendingFile();
    PendingFile(const PendingFile&) = delete;
    PendingFile& operator=(const PendingFile&) = delete;

    [[nodiscard]] const std::filesystem::path& path() const noexcept { return temporary_; }
    /// Throws OutputError.
    void commit();
    /// `target: cannot be written: why`, as an exception.
    [[noreturn]] void fail(std::string_view why) const;

private:
    std::filesystem::path target_;
    std::filesystem::path temporary_;
};

/// Throws OutputError unless `directory` exists and a file can be made in it.
void require_writable(const std::filesystem::path& directory);

/// Makes `directory` and what leads to it if need be, then as require_writable().
void make_writable(const std::filesystem::path& directory);

} // namespace obscura::images
