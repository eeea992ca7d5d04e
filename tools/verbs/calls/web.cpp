// SPDX-License-Identifier: Apache-2.0
// Verb `obscura web`: prints the link of the running page.
#include "core/error.hpp"
#include "core/text/printable.hpp"
#include "host/web_links.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>

#include <string>
#include <vector>

namespace obscura::tools {
namespace {

class Web final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "prints the link of the page that obscura-web serves";
        line.description =
            "Prints a line for each obscura-web that this user has started: open it in a browser. "
            "It holds a token, which serves as long as that program runs, so keep it to yourself. "
            "A server with a file of tokens (--tokens, as the service obscura-web.service has one) knows only their hashes: its link asks for a token, and obscura-web --tokens FILE --new-token viewer makes one and prints a link with it. "
            "The exit status is 69 if there is none.";
        line.examples = {
            "obscura-web & sleep 1; obscura web", "xdg-open $(obscura web)",
            "sudo obscura-web --tokens /etc/obscura/web-tokens --new-token operator    # a link for the service"};
    }

    int run() override {
        const std::vector<std::string> links = host::web_links();
        if (links.empty())
            throw HardwareError(
                "obscura web: no obscura-web of this user runs; "
                "start one: obscura-web, which prints its link (that of the service: obscura web --help)");
        for (const std::string& link : links)
            fmt::print("{}\n", for_terminal(link));
        return exit_ok;
    }
};

} // namespace

std::unique_ptr<Verb> make_web() {
    return std::make_unique<Web>();
}

} // namespace obscura::tools
