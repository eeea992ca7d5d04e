// SPDX-License-Identifier: Apache-2.0
// Options of verbs that ask a daemon through an obscura-web: its address, token and certificates.
#pragma once

#include "host/command_line.hpp"
#include "tools/control/http_calls.hpp"

#include <string>
#include <string_view>

namespace obscura::tools {

/// Thread-bound.
class UrlOptions {
public:
    /// `token_help`: what else than the token of obscura-web stands in the file of --token-file.
    void declare(host::CommandLine& line, const std::string& token_help = {});
    [[nodiscard]] bool given() const noexcept { return !url_.empty(); }
    [[nodiscard]] const std::string& token_file() const noexcept { return token_file_; }

    /// Address and token, which stands behind the address, in the file or in the environment. Warns on
    /// standard error, in one line, of a token that would cross the network as it is. Throws InputError.
    [[nodiscard]] HttpOptions http(std::string_view verb) const;

private:
    std::string url_, token_file_, authority_;
};

/// Whether a URL is of this machine's loopback interface, or encrypted.
[[nodiscard]] bool keeps_secrets(std::string_view url);

} // namespace obscura::tools
