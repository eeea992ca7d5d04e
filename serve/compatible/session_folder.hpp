// SPDX-License-Identifier: Apache-2.0
// Private folder of a session, for files that its scene is made of.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

namespace obscura::serve::compatible {

/// Private folder of a session for files that the scene is made of; removed at the end.
class SessionFolder {
public:
    /// For files of so many bytes in all. Throws HardwareError if it cannot be made.
    explicit SessionFolder(std::uint64_t max_bytes);
    ~SessionFolder();
    SessionFolder(const SessionFolder&) = delete;
    SessionFolder& operator=(const SessionFolder&) = delete;

    [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
    /// Writes a new file whose name ends with `ending`. Returns its absolute path. Throws Failure, also if it
    /// is too large beside the others.
    [[nodiscard]] std::string write(std::string_view ending, std::string_view content);
    /// As write(); the same content again gives the same file, until sweep() finds that it was not asked for
    /// since the sweep before.
    [[nodiscard]] std::string file_of(std::string_view ending, const std::string& content);
    void sweep();
    /// Removes a file that write() made; another or an empty name does nothing.
    void remove(const std::string& file);
    /// Removes all files.
    void clear();
    /// Counts a file of write() that others have written to since, of `bytes`. Throws Failure if it is too
    /// large; to be called before it is written.
    void count(const std::string& file, std::uint64_t bytes);

private:
    std::filesystem::path path_;
    const std::uint64_t max_bytes_;
    std::uint64_t bytes_ = 0;
    std::map<std::string, std::uint64_t> sizes_; ///< of the files that are there
    std::uint64_t files_ = 0;
    struct Made {
        std::string file;
        bool used = false;
    };
    std::map<std::string, Made> made_; ///< by content, of file_of()
};

} // namespace obscura::serve::compatible
