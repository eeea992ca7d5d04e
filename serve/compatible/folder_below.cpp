// SPDX-License-Identifier: Apache-2.0
#include "serve/compatible/folder_below.hpp"

#include "config/document.hpp"
#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "core/text/printable.hpp"
#include "service/failure.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/openat2.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

namespace obscura::serve {
namespace {

using service::Failure;
using service::FailureCode;

constexpr std::uint64_t resolve_below = RESOLVE_BENEATH | RESOLVE_NO_MAGICLINKS;

/// glibc has no function for it.
FileDescriptor open_below(int folder, const std::string& name, int flags) {
    open_how how{};
    how.flags = static_cast<std::uint64_t>(flags | O_CLOEXEC);
    how.resolve = resolve_below;
    return FileDescriptor(static_cast<int>(::syscall(SYS_openat2, folder, name.c_str(), &how, sizeof how)));
}

Failure failure_of(FailureCode code, const std::string& name, const std::string& what) {
    return {code, fmt::format("\"{}\": {}", printable(name), what)};
}

std::string checked(const std::string& name) {
    if (name.find('\0') != std::string::npos)
        throw failure_of(FailureCode::forbidden, name, "no file has such a name");
    return name.empty() ? "." : name;
}

std::filesystem::path real_path(const FileDescriptor& opened) {
    return std::filesystem::read_symlink(fmt::format("/proc/self/fd/{}", opened.get()));
}

} // namespace

FolderBelow::FolderBelow(std::filesystem::path folder)
    : path_(std::move(folder)), folder_(::open(path_.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC)) {
    if (!folder_)
        throw InputError(fmt::format("{}: cannot be opened as a folder: {}", path_.string(),
                                     std::generic_category().message(errno)));
    path_ = real_path(folder_);
}

std::optional<std::filesystem::path> FolderBelow::find(const std::string& name) const {
    const FileDescriptor found = open_below(folder_.get(), checked(name), O_PATH);
    if (found) return real_path(found);
    if (errno == ENOENT || errno == ENOTDIR) return {};
    if (errno == EXDEV)
        throw failure_of(FailureCode::forbidden, name, "only files below the server's folder can be used");
    throw failure_of(FailureCode::bad_argument, name, std::generic_category().message(errno));
}

std::filesystem::path FolderBelow::place_for(const std::string& name, bool make_folders) const {
    const std::filesystem::path wanted = checked(name);
    if (wanted.filename().empty() || wanted.filename() == "." || wanted.filename() == "..")
        throw failure_of(FailureCode::bad_argument, name, "is no name of a file");
    std::filesystem::path folder;
    if (make_folders)
        for (const std::filesystem::path& part : wanted.parent_path()) {
            const std::string above = folder.string();
            folder /= part;
            if (find(folder.string())) continue;
            const FileDescriptor at = open_below(folder_.get(), checked(above), O_PATH | O_DIRECTORY);
            if (!at || (::mkdirat(at.get(), part.c_str(), 0777) != 0 && errno != EEXIST))
                throw failure_of(FailureCode::bad_argument, name, "its folder cannot be made");
        }
    const auto parent = find(wanted.parent_path().string());
    if (!parent || !is_folder_at(*parent))
        throw failure_of(FailureCode::bad_argument, name, "there is no such folder below the output folder");
    // A link may lead out of the folder, and a writer would follow it.
    if (const auto there = find(name); there && !is_file_at(*there))
        throw failure_of(FailureCode::bad_argument, name, "is there already, and is no file");
    return *parent / wanted.filename();
}

std::vector<std::string> FolderBelow::list(const std::string& name) const {
    const auto folder = find(name);
    std::error_code error;
    std::vector<std::string> names;
    if (folder)
        for (const std::filesystem::path& entry : paths_in(*folder, error))
            names.push_back(entry.filename().string() + (is_folder_at(entry) ? "/" : ""));
    if (!folder || (error && names.empty()))
        throw failure_of(FailureCode::bad_argument, name, "there is no such folder");
    std::sort(names.begin(), names.end());
    return names;
}

} // namespace obscura::serve
