// SPDX-License-Identifier: Apache-2.0
// File with the link of a running web server, where programs of the same user find it.
#pragma once

#include "core/io/file_descriptor.hpp"

#include <filesystem>
#include <string_view>

namespace obscura::web {

/// obscura-web-PID.link in a folder, for the user alone; locked while this process runs, so that readers know
/// it from one that a killed process has left, and removed at the end. Where the folder is not the user's
/// own, or is not there, nothing is written: the link is printed, too.
class LinkFile {
public:
    LinkFile(const std::filesystem::path& folder, std::string_view link);
    ~LinkFile();
    LinkFile(const LinkFile&) = delete;
    LinkFile& operator=(const LinkFile&) = delete;

private:
    std::filesystem::path path_; ///< empty: there is none
    FileDescriptor file_;
};

} // namespace obscura::web
