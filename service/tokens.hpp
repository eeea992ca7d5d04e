// SPDX-License-Identifier: Apache-2.0
// Tokens: secrets of clients that come over a network, proved by HMAC-SHA256 of a challenge.
#pragma once

#include "service/permission.hpp"

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::service {

constexpr std::size_t token_bytes = 32;
using Token = std::array<std::uint8_t, token_bytes>;

/// Writes a new token of random bytes to a file of mode 0640 that does not exist yet. Throws OutputError.
void make_token_file(const std::filesystem::path& file);
/// Reads a token. Throws ConfigError unless the file has 32 bytes and mode 0640 or stricter.
[[nodiscard]] Token read_token_file(const std::filesystem::path& file);

/// 32 random bytes as 64 hexadecimal digits.
[[nodiscard]] std::string make_challenge();
/// HMAC-SHA256 of the bytes of the challenge, keyed by the token: 64 hexadecimal digits.
[[nodiscard]] std::string proof_of(const Token& token, std::string_view challenge);

/// The tokens that a server takes, each with what it permits, and the wrong proofs that it got from each
/// address. Thread-bound.
class Tokens {
public:
    using Clock = std::chrono::steady_clock;

    void add(Permission permission, const Token& token) { all_.push_back({permission, token}); }
    [[nodiscard]] bool empty() const noexcept { return all_.empty(); }
    /// The most that a token permits which makes this proof; none: it is wrong, and is counted. Takes the
    /// same time for any proof of that length. `peer`: address that it came from.
    [[nodiscard]] std::optional<Permission> permission_of(std::string_view challenge, std::string_view proof,
                                                          const std::string& peer, Clock::time_point now);
    /// How long the next proof from that address has to wait, right or wrong: a second after three wrong ones
    /// within a minute.
    [[nodiscard]] std::chrono::milliseconds delay(const std::string& peer, Clock::time_point now) const;

private:
    struct Row {
        Permission permission;
        Token token;
    };
    void count_wrong(const std::string& peer, Clock::time_point now);

    std::vector<Row> all_;
    std::map<std::string, std::vector<Clock::time_point>> wrong_; ///< the last three of each address
};

/// How a connection comes to its permission.
struct Access {
    std::optional<Permission> permission; ///< none: it is that of a token
    Tokens* tokens = nullptr;             ///< outlives the connection
    bool passes_files = false;            ///< over a Unix socket
    std::string peer{};                   ///< address of the client, over TCP
};

} // namespace obscura::service
