// SPDX-License-Identifier: Apache-2.0
// Access control: bearer tokens with roles, names of this server, and addresses that guess tokens.
#pragma once

#include "core/text/enum_names.hpp"

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace obscura::web {

/// What a token allows, each with those before it.
enum class Role : std::uint8_t {
    viewer,  ///< read
    control, ///< change cameras and scenes
    admin,   ///< all of it, and what stays
};
constexpr auto enum_names(Role /*type*/) {
    return std::array{EnumName{Role::viewer, "viewer"}, EnumName{Role::control, "operator"},
                      EnumName{Role::admin, "admin"}};
}

/// Holder of a token.
struct Holder {
    Role role = Role::viewer;
    std::string name; ///< that the file gives, else the first 8 digits of the token's hash
};

/// Tokens that the server knows, as SHA-256 of each: the file that keeps them gives none away.
class Tokens {
public:
    Tokens() = default;
    /// Reads lines "ROLE SHA256 [NAME]"; "#" begins a comment. Throws InputError with file, line and what is
    /// allowed.
    [[nodiscard]] static Tokens read(const std::filesystem::path& file);
    /// A new one: 32 random bytes in 43 characters of base64url. Throws HardwareError.
    [[nodiscard]] static std::string make();
    /// The line of a token in such a file, without its end. `name`: see is_name(); empty: none.
    [[nodiscard]] static std::string line(Role role, std::string_view token, std::string_view name);
    /// Whether a token may have that name: 1 to 32 letters, digits, ".", "_" and "-".
    [[nodiscard]] static bool is_name(std::string_view name);

    void add(Role role, std::string_view token);
    /// Takes as long whether a token is known or not, and which it is.
    [[nodiscard]] std::optional<Holder> holder_of(std::string_view token) const;

private:
    std::vector<std::pair<std::string, Holder>> hashes_;
};

/// Credentials of an Authorization header of that scheme, which is in lower case here and in any case there
/// (RFC 9110, 11.1); empty: another scheme.
[[nodiscard]] std::string_view credentials_of(std::string_view authorization, std::string_view scheme);

/// The password of a header Authorization of the scheme Basic; empty: it is none.
[[nodiscard]] std::string password_of_basic(std::string_view authorization);

/// Counts wrong tokens by address, and refuses those of which too many came within a minute.
class WrongTokens {
public:
    using Clock = std::chrono::steady_clock;
    static constexpr std::size_t most = 5;
    static constexpr std::chrono::seconds window{60};
    /// Addresses that are kept; of more the oldest go.
    static constexpr std::size_t max_addresses = 1024;

    void note(const std::string& address, Clock::time_point now);
    [[nodiscard]] bool too_many(const std::string& address, Clock::time_point now) const;

private:
    std::map<std::string, std::vector<Clock::time_point>> times_;
};

/// Names by which browsers and programs may call this server. A page of another site whose name has been
/// pointed at this machine (DNS rebinding) sends another one.
class OwnNames {
public:
    /// `names`: "bench.example.org" at `port`, that of the listener; "localhost:9000" at another one, that of
    /// a tunnel; "https://bench.example.org" of a proxy. localhost, 127.0.0.1 and [::1] are always allowed.
    /// `secure`: pages come by https.
    OwnNames(const std::vector<std::string>& names, std::uint16_t port, bool secure = false);
    /// Whether a name can be one of those: no path, no user, a port that is a number.
    [[nodiscard]] static bool is_name(std::string_view name);
    [[nodiscard]] static bool has_port(std::string_view name);
    /// `host`: header Host, as it stands.
    [[nodiscard]] bool allows_host(std::string_view host) const;
    /// `origin`: header Origin; a request without one does not come from a page.
    [[nodiscard]] bool allows_origin(std::string_view origin) const;

private:
    std::vector<std::string> hosts_, origins_;
};

} // namespace obscura::web
