// SPDX-License-Identifier: Apache-2.0
// SHA-256 (FIPS 180-4) of bytes and files, by libcrypto, which uses the processor's instructions for it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

struct evp_md_ctx_st;

namespace obscura::host {

/// Digest of bytes that come in pieces. Thread-bound.
class Sha256 {
public:
    Sha256();
    void add(std::span<const std::byte> bytes);
    /// The digest as 64 lower-case hexadecimal digits; nothing may follow.
    [[nodiscard]] std::string hex();

private:
    struct Free {
        void operator()(evp_md_ctx_st* context) const noexcept;
    };
    std::unique_ptr<evp_md_ctx_st, Free> context_;
};

/// Content of a file: its length and SHA-256.
struct FileDigest {
    std::uint64_t bytes = 0;
    std::string sha256;

    bool operator==(const FileDigest&) const = default;
};
/// Reads the whole file. Throws InputError.
[[nodiscard]] FileDigest digest_of(const std::filesystem::path& file);
/// Reads blocks of 64 KiB, 256 of them evenly spaced from the first to the last byte, or the whole file if it
/// is no longer than `sampled_above`. Throws InputError.
[[nodiscard]] FileDigest sampled_digest_of(const std::filesystem::path& file);
inline constexpr std::uint64_t sampled_above = std::uint64_t{64} << 20;

[[nodiscard]] std::string sha256_of(std::string_view text);

/// Whether `text` is written as Sha256::hex() writes it.
[[nodiscard]] bool is_sha256(std::string_view text);

} // namespace obscura::host
