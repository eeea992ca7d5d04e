// SPDX-License-Identifier: Apache-2.0
#include "web/server/link_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdio>
#include <string>
#include <system_error>
#include <utility>

namespace obscura::web {

LinkFile::LinkFile(const std::filesystem::path& folder, std::string_view link) {
    struct stat status {};
    if (::lstat(folder.c_str(), &status) != 0 || !S_ISDIR(status.st_mode) || status.st_uid != ::geteuid() ||
        (status.st_mode & (S_IWGRP | S_IWOTH)) != 0)
        return;
    std::filesystem::path path = folder / fmt::format("obscura-web-{}.link", ::getpid());
    // Readers find it by its name once it is locked.
    const std::filesystem::path made = folder / fmt::format(".obscura-web-{}.new", ::getpid());
    std::error_code ignored;
    std::filesystem::remove(made, ignored); // of a process before, which was killed
    FileDescriptor file(::open(made.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600));
    if (!file) return;
    const std::string line = fmt::format("{}\n", link);
    if (::flock(file.get(), LOCK_EX | LOCK_NB) != 0 ||
        ::write(file.get(), line.data(), line.size()) != static_cast<ssize_t>(line.size()) ||
        ::rename(made.c_str(), path.c_str()) != 0) {
        std::filesystem::remove(made, ignored);
        return;
    }
    path_ = std::move(path);
    file_ = std::move(file);
}

LinkFile::~LinkFile() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove(path_, ignored);
}

} // namespace obscura::web
