// SPDX-License-Identifier: Apache-2.0
#include "web/server/access.hpp"

#include "core/error.hpp"
#include "core/io/random_bytes.hpp"
#include "core/io/text_file.hpp"
#include "core/text/text.hpp"
#include "host/sha256.hpp"

#include <fmt/format.h>
#include <openssl/crypto.h>
#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <span>
#include <sstream>

namespace obscura::web {
namespace {

/// Of "SCHEME://NAME:PORT"; scheme and port may be missing.
struct NameParts {
    std::string_view scheme, name, port;
};

NameParts parts_of(std::string_view text) {
    NameParts parts;
    for (const std::string_view scheme : {"http://", "https://"})
        if (text.starts_with(scheme)) parts.scheme = scheme;
    parts.name = text.substr(parts.scheme.size());
    const std::size_t colon = parts.name.rfind(':');
    if (colon == std::string_view::npos || parts.name.ends_with(']')) return parts;
    parts.port = parts.name.substr(colon + 1);
    parts.name = parts.name.substr(0, colon);
    return parts;
}

} // namespace

Tokens Tokens::read(const std::filesystem::path& file) {
    constexpr std::size_t max_token_file_bytes = std::size_t{16} << 20;
    std::string content;
    if (const std::string why = read_plain_text(file, max_token_file_bytes, content, InputKind::system);
        !why.empty())
        throw InputError(fmt::format("{}: {}", file.string(), why));
    std::istringstream in(content);
    Tokens tokens;
    std::string text;
    for (std::size_t number = 1; std::getline(in, text); ++number) {
        if (text.empty() || text.front() == '#') continue;
        std::istringstream words(text);
        std::string role, hash, name, more;
        words >> role >> hash >> name >> more;
        const std::optional<Role> known = enum_named<Role>(role);
        if (!known || !host::is_sha256(hash) || !(name.empty() || is_name(name)) || !more.empty())
            throw InputError(fmt::format(
                "{}:{}: a line is a role (viewer, operator or admin), 64 hexadecimal digits, and perhaps a name, as obscura-web --new-token writes it",
                file.string(), number));
        tokens.hashes_.emplace_back(hash, Holder{*known, name.empty() ? hash.substr(0, 8) : name});
    }
    return tokens;
}

std::string Tokens::make() {
    static constexpr std::string_view digits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
    std::array<unsigned char, 32> bytes{};
    fill_with_random_bytes(std::as_writable_bytes(std::span(bytes)));
    std::string token;
    for (std::size_t bit = 0; bit < 8 * bytes.size(); bit += 6) {
        const unsigned first = bytes[bit / 8], second = bit / 8 + 1 < bytes.size() ? bytes[bit / 8 + 1] : 0u;
        token += digits[(first << 8 | second) >> (10 - bit % 8) & 63u];
    }
    return token;
}

std::string Tokens::line(Role role, std::string_view token, std::string_view name) {
    return fmt::format("{} {}{}{}", name_of(role), host::sha256_of(token), name.empty() ? "" : " ", name);
}

bool Tokens::is_name(std::string_view name) {
    return !name.empty() && name.size() <= 32 && std::all_of(name.begin(), name.end(), [](unsigned char c) {
        return std::isalnum(c) != 0 || c == '.' || c == '_' || c == '-';
    });
}

void Tokens::add(Role role, std::string_view token) {
    const std::string hash = host::sha256_of(token);
    hashes_.emplace_back(hash, Holder{role, hash.substr(0, 8)});
}

std::optional<Holder> Tokens::holder_of(std::string_view token) const {
    const std::string hash = host::sha256_of(token);
    const Holder* found = nullptr;
    for (const auto& [known, holder] : hashes_)
        if (CRYPTO_memcmp(known.data(), hash.data(), hash.size()) == 0) found = &holder;
    return found == nullptr ? std::nullopt : std::optional(*found);
}

std::string_view credentials_of(std::string_view authorization, std::string_view scheme) {
    const std::size_t blank = std::min(authorization.find(' '), authorization.size());
    return lower_case(authorization.substr(0, blank)) == scheme ? trimmed(authorization.substr(blank)) : "";
}

std::string password_of_basic(std::string_view authorization) {
    constexpr std::size_t most = 512;
    const std::string_view text = credentials_of(authorization, "basic");
    if (text.empty() || text.size() > most) return {};
    std::array<unsigned char, most> bytes{};
    // Refuses what is no base64; the padding counts as bytes of 0.
    const int count = ::EVP_DecodeBlock(bytes.data(), reinterpret_cast<const unsigned char*>(text.data()),
                                        static_cast<int>(text.size()));
    if (count <= 0) return {};
    std::string_view pair(reinterpret_cast<const char*>(bytes.data()), static_cast<std::size_t>(count));
    while (pair.ends_with('\0'))
        pair.remove_suffix(1);
    const std::size_t colon = pair.find(':');
    return colon == std::string_view::npos ? std::string() : std::string(pair.substr(colon + 1));
}

void WrongTokens::note(const std::string& address, Clock::time_point now) {
    if (!times_.contains(address) && times_.size() >= max_addresses)
        times_.erase(std::min_element(times_.begin(), times_.end(), [](const auto& a, const auto& b) {
            return a.second.back() < b.second.back();
        }));
    std::vector<Clock::time_point>& times = times_[address];
    if (times.size() >= most) times.erase(times.begin());
    times.push_back(now);
}

bool WrongTokens::too_many(const std::string& address, Clock::time_point now) const {
    const auto found = times_.find(address);
    return found != times_.end() && found->second.size() >= most && now - found->second.front() < window;
}

OwnNames::OwnNames(const std::vector<std::string>& names, std::uint16_t port, bool secure) {
    const auto add = [&](std::string_view text) {
        const NameParts parts = parts_of(text);
        const std::string name = lower_case(parts.name);
        const std::string scheme =
            parts.scheme.empty() ? secure ? "https://" : "http://" : lower_case(parts.scheme);
        const std::string_view usual = scheme == "https://" ? "443" : "80";
        const std::string number = !parts.port.empty()    ? std::string(parts.port)
                                   : parts.scheme.empty() ? fmt::format("{}", port)
                                                          : std::string(usual);
        hosts_.push_back(fmt::format("{}:{}", name, number));
        origins_.push_back(fmt::format("{}{}:{}", scheme, name, number));
        if (number != usual) return;
        hosts_.push_back(name);
        origins_.push_back(scheme + name);
    };
    for (const char* own : {"localhost", "127.0.0.1", "[::1]"})
        add(own);
    for (const std::string& name : names)
        add(name);
}

bool OwnNames::is_name(std::string_view text) {
    const NameParts parts = parts_of(text);
    const bool colon = parts.port.empty() && text.ends_with(':');
    const bool bracketed = parts.name.starts_with('[') && parts.name.ends_with(']');
    std::uint16_t number = 1;
    const auto [end, bad] = std::from_chars(parts.port.data(), parts.port.data() + parts.port.size(), number);
    const bool good_port = parts.port.empty() ||
                           (bad == std::errc{} && end == parts.port.data() + parts.port.size() && number > 0);
    return !parts.name.empty() && !colon && good_port &&
           std::all_of(parts.name.begin(), parts.name.end(), [&](unsigned char c) {
               return std::isalnum(c) != 0 || c == '.' || c == '-' || c == '_' ||
                      (bracketed && (c == ':' || c == '[' || c == ']'));
           });
}

bool OwnNames::has_port(std::string_view text) {
    return !parts_of(text).port.empty();
}

bool OwnNames::allows_host(std::string_view host) const {
    return std::find(hosts_.begin(), hosts_.end(), lower_case(host)) != hosts_.end();
}

bool OwnNames::allows_origin(std::string_view origin) const {
    return std::find(origins_.begin(), origins_.end(), lower_case(origin)) != origins_.end();
}

} // namespace obscura::web
