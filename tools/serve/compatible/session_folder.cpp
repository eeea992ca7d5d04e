// SPDX-License-Identifier: Apache-2.0
#include "tools/serve/compatible/session_folder.hpp"

#include "core/error.hpp"
#include "service/failure.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <system_error>
#include <utility>

namespace obscura::tools::compatible {

using service::Failure;
using service::FailureCode;

SessionFolder::SessionFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "obscura-serve-XXXXXX").string();
    if (::mkdtemp(pattern.data()) == nullptr)
        throw HardwareError(fmt::format("{}: {}", pattern, std::strerror(errno)));
    path_ = std::filesystem::canonical(pattern);
}

SessionFolder::~SessionFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

std::string SessionFolder::write(std::string_view ending, std::string_view content) {
    const std::filesystem::path file = path_ / fmt::format("{}{}", files_++, ending);
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
    if (std::filesystem::path(file).parent_path() == path_) std::filesystem::remove(file, ignored);
}

} // namespace obscura::tools::compatible
