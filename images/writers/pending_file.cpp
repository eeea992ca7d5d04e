// SPDX-License-Identifier: Apache-2.0
#include "images/writers/pending_file.hpp"

#include "core/io/path_state.hpp"
#include "core/io/temporary_name.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <mutex>
#include <set>
#include <utility>

namespace obscura::images {
namespace {

std::mutex pending_mutex;
std::set<std::filesystem::path> pending; // temporary files that exist, with the mutex

} // namespace

PendingFile::PendingFile(std::filesystem::path target)
    : target_(std::move(target)), temporary_(temporary_beside(target_)) {
    // Create the file here, so that an unwritable folder is reported by errno and not by an image library.
    const std::lock_guard lock(pending_mutex);
    const int file = open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file < 0) fail(std::strerror(errno), errno);
    close(file);
    pending.insert(temporary_);
}

PendingFile::~PendingFile() {
    if (temporary_.empty()) return;
    const std::lock_guard lock(pending_mutex);
    unlink(temporary_.c_str());
    pending.erase(temporary_);
}

void PendingFile::commit() {
    const std::lock_guard lock(pending_mutex);
    if (rename(temporary_.c_str(), target_.c_str()) != 0) fail(std::strerror(errno), errno);
    pending.erase(temporary_);
    temporary_.clear();
}

void remove_pending_files() noexcept {
    pending_mutex.lock();
    for (const std::filesystem::path& file : pending)
        unlink(file.c_str());
}

void PendingFile::fail(std::string_view why, int cause) const {
    throw OutputError(fmt::format("{}: cannot be written: {}", target_.string(), why), cause);
}

void require_writable(const std::filesystem::path& directory) {
    std::error_code error;
    const auto status = std::filesystem::status(directory, error);
    if (!std::filesystem::exists(status))
        throw OutputError(fmt::format("{}: no such directory", directory.string()),
                          error ? error.value() : ENOENT);
    if (!std::filesystem::is_directory(status))
        throw OutputError(fmt::format("{}: not a directory", directory.string()), ENOTDIR);
    const auto probe = temporary_beside(directory / "probe");
    const int file = open(probe.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file < 0)
        throw OutputError(fmt::format("{}: cannot be written: {}", directory.string(), std::strerror(errno)),
                          errno);
    close(file);
    unlink(probe.c_str());
}

void make_writable(const std::filesystem::path& directory) {
    std::error_code error;
    std::filesystem::create_directories(directory, error);
    if (error && !path_exists(directory))
        throw OutputError(fmt::format("{}: cannot be created: {}", directory.string(), error.message()),
                          error.value());
    require_writable(directory);
}

} // namespace obscura::images
