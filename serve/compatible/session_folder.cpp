// SPDX-License-Identifier: Apache-2.0
#include "serve/compatible/session_folder.hpp"

#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "service/failure.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <system_error>
#include <utility>

namespace obscura::serve::compatible {

using service::Failure;
using service::FailureCode;

SessionFolder::SessionFolder(std::uint64_t max_bytes) : max_bytes_(max_bytes) {
    std::string pattern = (temporary_files_folder() / "obscura-serve-XXXXXX").string();
    if (::mkdtemp(pattern.data()) == nullptr)
        throw HardwareError(fmt::format("{}: {}", pattern, std::strerror(errno)));
    path_ = real_path(pattern);
}

SessionFolder::~SessionFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

std::string SessionFolder::write(std::string_view ending, std::string_view content) {
    const std::filesystem::path file = path_ / fmt::format("{}{}", files_++, ending);
    count(file.string(), content.size());
    std::ofstream out(file, std::ios::binary);
    out.write(content.data(), static_cast<std::streamsize>(content.size()));
    out.close();
    if (!out) throw Failure(FailureCode::internal, "the server cannot write to its temporary folder");
    return file.string();
}

std::string SessionFolder::file_of(std::string_view ending, const std::string& content) {
    Made& made = made_[content];
    if (made.file.empty()) made.file = write(ending, content);
    made.used = true;
    return made.file;
}

void SessionFolder::sweep() {
    for (auto made = made_.begin(); made != made_.end();) {
        if (std::exchange(made->second.used, false)) {
            ++made;
            continue;
        }
        remove(made->second.file);
        made = made_.erase(made);
    }
}

void SessionFolder::remove(const std::string& file) {
    std::error_code ignored;
    if (const auto known = sizes_.find(file); known != sizes_.end()) {
        bytes_ -= known->second;
        sizes_.erase(known);
    }
    if (std::filesystem::path(file).parent_path() == path_) std::filesystem::remove(file, ignored);
}

void SessionFolder::clear() {
    while (!sizes_.empty())
        remove(std::string(sizes_.begin()->first));
    made_.clear();
}

void SessionFolder::count(const std::string& file, std::uint64_t bytes) {
    const auto known = sizes_.find(file);
    const std::uint64_t others = bytes_ - (known != sizes_.end() ? known->second : 0);
    if (bytes > max_bytes_ || others > max_bytes_ - bytes)
        throw Failure(FailureCode::too_large,
                      fmt::format("{} bytes beside {} of textures, tables and meshes, allowed {} in all",
                                  bytes, others, max_bytes_));
    sizes_[file] = bytes;
    bytes_ = others + bytes;
}

} // namespace obscura::serve::compatible
