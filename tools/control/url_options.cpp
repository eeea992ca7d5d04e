// SPDX-License-Identifier: Apache-2.0
#include "tools/control/url_options.hpp"

#include "core/text/printable.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <fstream>

namespace obscura::tools {

void UrlOptions::declare(host::CommandLine& line, const std::string& token_help) {
    line.option(
        "--url", &url_, "URL",
        "Ask the daemon behind an obscura-web on another machine, https://HOST:8420, or a link as obscura web prints it; "
        "else its token comes from --token-file or the environment variable OBSCURA_TOKEN");
    line.option("--token-file", &token_file_, "FILE",
                token_help + "with --url: file whose first line is the token of obscura-web");
    line.option("--cacert", &authority_, "FILE",
                "With --url: certificates that are trusted, instead of those of the system");
}

HttpOptions UrlOptions::http(std::string_view verb) const {
    HttpOptions options{.url = url_, .token = {}, .authority = authority_};
    // A link as `obscura web` prints it has the token behind it.
    constexpr std::string_view mark = "/#token=";
    if (const std::size_t at = url_.find(mark); at != std::string::npos) {
        options.token = url_.substr(at + mark.size());
        options.url.erase(at);
    } else if (token_file_.empty()) {
        const char* const token = std::getenv("OBSCURA_TOKEN");
        options.token = token == nullptr ? "" : token;
    } else {
        std::ifstream in(token_file_);
        if (!std::getline(in, options.token))
            throw InputError(fmt::format("obscura {}: --token-file {}: cannot be read", verb, token_file_));
    }
    if (!options.token.empty() && !keeps_secrets(options.url))
        print_message(fmt::format(
            "obscura {}: warning: the token crosses the network as it is, for everyone on the way to read: {} has no TLS; "
            "use https:// or a tunnel (ssh -L)",
            verb, for_terminal(options.url)));
    return options;
}

bool keeps_secrets(std::string_view url) {
    const auto lower = [](std::string_view text) {
        std::string small(text);
        std::transform(small.begin(), small.end(), small.begin(),
                       [](char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); });
        return small;
    };
    const std::size_t scheme = url.find("://");
    if (scheme == std::string_view::npos || lower(url.substr(0, scheme)) != "http") return true;
    std::string_view host = url.substr(scheme + 3);
    host = host.substr(0, host.find_first_of("/?#\\"));
    if (const std::size_t user = host.rfind('@'); user != std::string_view::npos)
        host.remove_prefix(user + 1);
    host = host.starts_with('[') ? host.substr(0, host.find(']') + 1) : host.substr(0, host.find(':'));
    const bool dotted =
        host.starts_with("127.") && std::count(host.begin(), host.end(), '.') == 3 &&
        std::all_of(host.begin(), host.end(), [](char c) { return c == '.' || (c >= '0' && c <= '9'); });
    return dotted || host == "[::1]" || lower(host) == "localhost";
}

} // namespace obscura::tools
