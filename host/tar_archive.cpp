// SPDX-License-Identifier: Apache-2.0
#include "host/tar_archive.hpp"

#include "images/writers/pending_file.hpp"

#include <fmt/format.h>
#include <zstd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <numeric>
#include <stdexcept>

namespace obscura::host {
namespace {

constexpr std::size_t block_bytes = 512;

} // namespace

void TarArchive::add(std::string_view name, std::string_view text) {
    // Fields of the header by their places, IEEE 1003.1 "ustar Interchange Format".
    std::array<char, block_bytes> header{};
    const auto put = [&header](std::size_t place, std::string_view field) {
        field.copy(header.data() + place, field.size());
    };
    const std::string path = fmt::format("{}/{}", folder_, name);
    constexpr std::size_t max_path_bytes = 100;
    if (path.size() > max_path_bytes) throw std::invalid_argument(path + ": too long for an archive");
    put(0, path);
    put(100, "0000600");                           // mode
    put(108, "0000000"), put(116, "0000000");      // user, group
    put(124, fmt::format("{:011o}", text.size())); // bytes
    put(136, fmt::format("{:011o}", time_s_));
    put(148, "        "); // the checksum counts as blanks
    put(156, "0");        // ordinary file
    put(257, std::string_view("ustar\00000", 8));
    const unsigned sum = std::accumulate(header.begin(), header.end(), 0U, [](unsigned all, char c) {
        return all + static_cast<unsigned char>(c);
    });
    put(148, fmt::format("{:06o}", sum));
    header[154] = '\0';
    bytes_.append(header.data(), header.size());
    bytes_ += text;
    bytes_.append((block_bytes - text.size() % block_bytes) % block_bytes, '\0');
}

std::string TarArchive::packed() const {
    const std::string whole = bytes_ + std::string(2 * block_bytes, '\0');
    std::string packed(ZSTD_compressBound(whole.size()), '\0');
    constexpr int level = 9;
    const std::size_t size = ZSTD_compress(packed.data(), packed.size(), whole.data(), whole.size(), level);
    if (ZSTD_isError(size) != 0) throw std::runtime_error(ZSTD_getErrorName(size));
    packed.resize(size);
    return packed;
}

void TarArchive::write(const std::filesystem::path& file) const {
    const std::string all = packed();
    images::PendingFile pending(file);
    std::ofstream out(pending.path(), std::ios::binary);
    std::error_code error;
    std::filesystem::permissions(
        pending.path(), std::filesystem::perms::owner_read | std::filesystem::perms::owner_write, error);
    out.write(all.data(), static_cast<std::streamsize>(all.size()));
    out.close();
    if (!out || error) pending.fail(error ? error.message() : std::strerror(errno));
    pending.commit();
}

} // namespace obscura::host
