// SPDX-License-Identifier: Apache-2.0
#include "service/tokens.hpp"

#include "core/error.hpp"
#include "core/io/file_descriptor.hpp"
#include "core/io/random_bytes.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <span>
#include <stdexcept>

namespace obscura::service {
namespace {

constexpr std::size_t tries_without_delay = 3;
constexpr std::chrono::minutes tries_count_for{1};
constexpr std::chrono::seconds later{1};
constexpr std::size_t max_addresses = 1000;
constexpr mode_t allowed_mode = 0640;

Token random_token() {
    Token token{};
    fill_with_random_bytes(std::as_writable_bytes(std::span(token)));
    return token;
}

std::string hex(std::span<const std::uint8_t> bytes) {
    return fmt::format("{:02x}", fmt::join(bytes, ""));
}

} // namespace

void make_token_file(const std::filesystem::path& file) {
    const Token token = random_token();
    const FileDescriptor out(::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, allowed_mode));
    if (!out || ::write(out.get(), token.data(), token.size()) != static_cast<ssize_t>(token.size()) ||
        ::fsync(out.get()) != 0)
        throw OutputError(fmt::format("{}: {}", file.string(), std::strerror(errno)), errno);
}

Token read_token_file(const std::filesystem::path& file) {
    const FileDescriptor in(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    struct stat about {};
    if (!in || ::fstat(in.get(), &about) != 0)
        throw ConfigError(fmt::format("{}: {}", file.string(), std::strerror(errno)));
    if (!S_ISREG(about.st_mode)) throw ConfigError(fmt::format("{}: no file", file.string()));
    const mode_t mode = about.st_mode & 07777;
    if ((mode & ~allowed_mode) != 0)
        throw ConfigError(fmt::format(
            "{}: mode {:04o}: a token must not be open to others, allowed {:04o} and stricter (chmod {:o})",
            file.string(), mode, allowed_mode, allowed_mode));
    Token token{};
    if (about.st_size != static_cast<off_t>(token.size()) ||
        ::read(in.get(), token.data(), token.size()) != static_cast<ssize_t>(token.size()))
        throw ConfigError(fmt::format("{}: {} bytes, a token has {} (obscura serve --make-token FILE)",
                                      file.string(), about.st_size, token.size()));
    return token;
}

std::string make_challenge() {
    return hex(random_token());
}

std::string proof_of(const Token& token, std::string_view challenge) {
    std::vector<std::uint8_t> bytes;
    for (std::size_t at = 0; at + 2 <= challenge.size(); at += 2) {
        const auto digit = [](char c) { return c <= '9' ? c - '0' : c - 'a' + 10; };
        bytes.push_back(static_cast<std::uint8_t>(16 * digit(challenge[at]) + digit(challenge[at + 1])));
    }
    std::array<std::uint8_t, EVP_MAX_MD_SIZE> out{};
    unsigned size = 0;
    if (::HMAC(EVP_sha256(), token.data(), static_cast<int>(token.size()), bytes.data(), bytes.size(),
               out.data(), &size) == nullptr)
        throw std::runtime_error("libcrypto has no HMAC-SHA256");
    return hex(std::span(out).first(size));
}

std::optional<Permission> Tokens::permission_of(std::string_view challenge, std::string_view proof,
                                                const std::string& peer, Clock::time_point now) {
    std::optional<Permission> found;
    for (const Row& row : all_) {
        const std::string right = proof_of(row.token, challenge);
        const bool same =
            right.size() == proof.size() && ::CRYPTO_memcmp(right.data(), proof.data(), right.size()) == 0;
        if (same && (!found || row.permission > *found)) found = row.permission;
    }
    if (!found) count_wrong(peer, now);
    return found;
}

void Tokens::count_wrong(const std::string& peer, Clock::time_point now) {
    if (wrong_.size() >= max_addresses)
        std::erase_if(wrong_, [now](const auto& row) { return now - row.second.back() >= tries_count_for; });
    // An address is forgotten rather than memory taken without end.
    if (wrong_.size() >= max_addresses && !wrong_.contains(peer)) wrong_.erase(wrong_.begin());
    std::vector<Clock::time_point>& times = wrong_[peer];
    if (times.size() == tries_without_delay) times.erase(times.begin());
    times.push_back(now);
}

std::chrono::milliseconds Tokens::delay(const std::string& peer, Clock::time_point now) const {
    const auto found = wrong_.find(peer);
    const bool slow = found != wrong_.end() && found->second.size() == tries_without_delay &&
                      now - found->second.front() < tries_count_for;
    return slow ? later : std::chrono::seconds(0);
}

} // namespace obscura::service
