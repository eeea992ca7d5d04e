// SPDX-License-Identifier: Apache-2.0
#include "web/link_file.hpp"

#include "core/file_descriptor.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <string>
#include <system_error>

namespace obscura::web {

LinkFile::LinkFile(const std::filesystem::path& folder, std::string_view link) {
    struct stat status {};
    if (::lstat(folder.c_str(), &status) != 0 || !S_ISDIR(status.st_mode) || status.st_uid != ::geteuid() ||
        (status.st_mode & (S_IWGRP | S_IWOTH)) != 0)
        return;
    std::filesystem::path path = folder / fmt::format("obscura-web-{}.link", ::getpid());
    std::error_code ignored;
    std::filesystem::remove(path, ignored); // of a process before, which was killed
    const FileDescriptor file(
        ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600));
    if (!file) return;
    const std::string line = fmt::format("{}\n", link);
    path_ = std::move(path);
    if (::write(file.get(), line.data(), line.size()) != static_cast<ssize_t>(line.size()))
        std::filesystem::remove(path_, ignored);
}

LinkFile::~LinkFile() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove(path_, ignored);
}

} // namespace obscura::web
