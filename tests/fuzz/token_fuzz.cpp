// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: files of tokens, of the web server and of the daemon's ports, and what clients give as a
// token or as the proof of one. Only the right one is taken.
//
// Input: a byte that chooses the kind, then the file, or the token or proof.
#include "core/error.hpp"
#include "service/tokens.hpp"
#include "tests/fuzz/memory_file.hpp"
#include "tests/fuzz/scratch_folder.hpp"
#include "web/server/access.hpp"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

using namespace obscura;
using test::require;

namespace {

using Clock = std::chrono::steady_clock;

void one_line(const Error& error) {
    const std::string_view why = error.what();
    require(!why.empty() && why.find('\n') == std::string_view::npos);
}

/// Lines "ROLE SHA256 [NAME]".
void web_file(std::string_view text) {
    try {
        const test::MemoryFile file(text.data(), text.size());
        const web::Tokens tokens = web::Tokens::read(file.path());
        require(!tokens.holder_of("")); // its hash cannot come by chance
    } catch (const InputError& error) {
        one_line(error);
    }
}

void web_token(std::string_view token) {
    static const web::Tokens tokens = [] {
        web::Tokens made;
        made.add(web::Role::viewer, "viewer's");
        made.add(web::Role::admin, "admin's");
        return made;
    }();
    const auto holder = tokens.holder_of(token);
    const bool known = token == "viewer's" || token == "admin's";
    require(holder.has_value() == known);
    require(!known || holder->role == (token == "admin's" ? web::Role::admin : web::Role::viewer));
}

/// A token of the daemon is 32 bytes of any value.
void daemon_file(std::string_view bytes) {
    static const test::ScratchFolder folder;
    const std::filesystem::path file = folder.write("token", bytes);
    std::filesystem::permissions(file,
                                 std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
    bool taken = false;
    try {
        const service::Token token = service::read_token_file(file);
        taken = true;
        require(std::equal(token.begin(), token.end(), bytes.begin(), bytes.end(),
                           [](std::uint8_t a, char b) { return a == static_cast<std::uint8_t>(b); }));
    } catch (const ConfigError& error) {
        one_line(error);
    }
    require(taken == (bytes.size() == service::token_bytes));
}

void proof(std::string_view text) {
    static const service::Token token{1, 2, 3};
    static const std::string challenge(64, 'a'), right = service::proof_of(token, challenge);
    service::Tokens tokens;
    tokens.add(service::Permission::scene, token);
    require(tokens.permission_of(challenge, text, "peer", Clock::now()).has_value() == (text == right));
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size < 1) return 0;
    const std::string_view text(reinterpret_cast<const char*>(data + 1), size - 1);
    switch (data[0] % 4) {
    case 0:
        web_file(text);
        break;
    case 1:
        web_token(text);
        break;
    case 2:
        daemon_file(text);
        break;
    default:
        proof(text);
    }
    return 0;
}
