// SPDX-License-Identifier: Apache-2.0
// A folder of files for fuzz targets, and what they demand of whatever reads them.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

namespace obscura::test {

/// What must hold for every input; a fuzzer finds an abort, whatever the build.
inline void require(bool truth) {
    if (!truth) std::abort();
}

/// A folder for as long as the object lives.
class ScratchFolder {
public:
    ScratchFolder() {
        std::string pattern = (std::filesystem::temp_directory_path() / "obscura_fuzz_XXXXXX").string();
        require(mkdtemp(pattern.data()) != nullptr);
        path_ = pattern;
    }
    ~ScratchFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;

    [[nodiscard]] const std::filesystem::path& path() const { return path_; }
    std::filesystem::path write(const char* name, std::string_view text) const {
        const std::filesystem::path file = path_ / name;
        std::ofstream out(file, std::ios::binary | std::ios::trunc);
        out.write(text.data(), static_cast<std::streamsize>(text.size()));
        require(out.good());
        return file;
    }

private:
    std::filesystem::path path_;
};

} // namespace obscura::test
