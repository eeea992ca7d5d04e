// SPDX-License-Identifier: Apache-2.0
#include "host/sha256.hpp"

#include "core/error.hpp"
#include "core/io/file_descriptor.hpp"
#include "core/io/input_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/evp.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <vector>

namespace obscura::host {
namespace {

/// A file that is read for its digest.
class DigestedFile {
public:
    explicit DigestedFile(const std::filesystem::path& file) : name_(file.string()) {
        require_regular_file(file);
        file_ = FileDescriptor(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
        const off_t end = file_ ? ::lseek(file_.get(), 0, SEEK_END) : -1;
        if (end < 0) fail();
        bytes_ = static_cast<std::uint64_t>(end);
    }
    [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

    /// Adds `count` bytes from `place` on, or fewer if the file ends before.
    void add_to(Sha256& digest, std::uint64_t place, std::uint64_t count) {
        while (count > 0) {
            const std::size_t wanted = std::min<std::uint64_t>(count, buffer_.size());
            const ssize_t got = ::pread(file_.get(), buffer_.data(), wanted, static_cast<off_t>(place));
            if (got < 0 && errno == EINTR) continue;
            if (got < 0) fail();
            if (got == 0) return;
            digest.add(std::span(buffer_).first(static_cast<std::size_t>(got)));
            place += static_cast<std::uint64_t>(got);
            count -= static_cast<std::uint64_t>(got);
        }
    }

private:
    [[noreturn]] void fail() const {
        throw InputError(fmt::format("{}: cannot be read: {}", name_, std::strerror(errno)), errno);
    }

    std::string name_;
    FileDescriptor file_;
    std::uint64_t bytes_ = 0;
    std::vector<std::byte> buffer_ = std::vector<std::byte>(std::size_t{1} << 18);
};

void require(int result) {
    if (result != 1) throw std::runtime_error("libcrypto has no SHA-256");
}

} // namespace

void Sha256::Free::operator()(evp_md_ctx_st* context) const noexcept {
    EVP_MD_CTX_free(context);
}

Sha256::Sha256() : context_(EVP_MD_CTX_new()) {
    require(EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr));
}

void Sha256::add(std::span<const std::byte> bytes) {
    require(EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size()));
}

std::string Sha256::hex() {
    std::array<unsigned char, 32> digest{};
    require(EVP_DigestFinal_ex(context_.get(), digest.data(), nullptr));
    return fmt::format("{:02x}", fmt::join(digest, ""));
}

FileDigest digest_of(const std::filesystem::path& file) {
    DigestedFile in(file);
    Sha256 digest;
    in.add_to(digest, 0, in.bytes());
    return {in.bytes(), digest.hex()};
}

FileDigest sampled_digest_of(const std::filesystem::path& file) {
    DigestedFile in(file);
    if (in.bytes() <= sampled_above) return digest_of(file);
    constexpr std::uint64_t block = 65536, blocks = 256;
    Sha256 digest;
    const std::uint64_t last = in.bytes() - block;
    for (std::uint64_t i = 0; i < blocks; ++i)
        in.add_to(digest, last / (blocks - 1) * i + last % (blocks - 1) * i / (blocks - 1), block);
    return {in.bytes(), digest.hex()};
}

std::string sha256_of(std::string_view text) {
    Sha256 digest;
    digest.add(std::as_bytes(std::span(text)));
    return digest.hex();
}

bool is_sha256(std::string_view text) {
    return text.size() == 64 && std::all_of(text.begin(), text.end(), [](char c) {
               return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
           });
}

} // namespace obscura::host
