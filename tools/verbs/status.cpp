// SPDX-License-Identifier: Apache-2.0
// Verb `obscura status`: shows what running daemons do.
#include "tools/control/rest_client.hpp"
#include "tools/control/url_options.hpp"
#include "tools/support/interrupt.hpp"
#include "tools/support/monitor_client.hpp"
#include "tools/support/status_text.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <ctime>
#include <optional>
#include <string>
#include <vector>

namespace obscura::tools {
namespace {

class Status final : public Verb {
public:
    void declare(CommandLine& line) override {
        line.summary = "shows what the cameras of running daemons do";
        line.description =
            "Asks every daemon of this machine that this user may ask, its own and those of services whose "
            "group (obscura) the user is in, and prints for each camera one line on whether it does what it "
            "should, who controls it, its trigger source, counters and latencies. The exit status is 0 if "
            "every camera is on time or idle, 1 if one is neither, with the first reason in its line, and 69 "
            "if no daemon answers.";
        line.option("--socket", &socket_, "PATH",
                    "Ask the daemon with this socket (its monitor.socket) only");
        url_.declare(line);
        line.number("--watch", &watch_s_, "SECONDS", "Show it again every SECONDS until interrupted; 0: once",
                    0, 3600);
        line.flag("--json", json_, "Print one JSON object a line for each daemon, as docs/monitor.md says");
        line.examples = {"obscura status", "obscura status --watch 1",
                         "obscura status --json | jq '.cameras[0].recent'",
                         "obscura status --url https://bench.example.org:8420"};
    }

    int run() override {
        try {
            return ask();
        } catch (const nlohmann::ordered_json::exception& error) {
            throw HardwareError(
                fmt::format("obscura status: the answer is not as expected: {}", error.what()));
        }
    }

private:
    int ask() {
        catch_interrupts();
        if (url_.given()) {
            if (!socket_.empty()) throw UsageError("obscura status: --url excludes --socket");
            web_.emplace("status", url_.http("status"));
        }
        bool good = true;
        for (bool first = true; !interrupted(); first = false) {
            if (!first) wait();
            if (interrupted()) break;
            good = show();
            if (watch_s_ <= 0) break;
        }
        return good ? exit_ok : exit_failure;
    }

    [[nodiscard]] std::vector<nlohmann::ordered_json> states() {
        if (web_) return web_->states();
        std::vector<nlohmann::ordered_json> states;
        for (const MonitorClient& client : connect_to_daemons(socket_))
            states.push_back(client.ask({{"verb", "state"}}));
        return states;
    }

    [[nodiscard]] bool show() {
        bool good = true;
        std::string text;
        for (const nlohmann::ordered_json& state : states()) {
            text += json_ ? state.dump() + "\n" : status_text(state);
            good = none_bad(state) && good;
        }
        // On a terminal each round replaces the one before.
        const bool replace = watch_s_ > 0 && !json_ && ::isatty(STDOUT_FILENO) != 0;
        fmt::print("{}{}", replace ? "\033[H\033[2J" : "", text);
        std::fflush(stdout);
        return good;
    }

    void wait() const {
        double whole = 0;
        const double rest = std::modf(watch_s_, &whole);
        const timespec pause{static_cast<std::time_t>(whole), static_cast<long>(rest * 1e9)};
        nanosleep(&pause, nullptr);
    }

    std::string socket_;
    UrlOptions url_;
    std::optional<RestClient> web_; ///< none: daemons of this machine are asked
    double watch_s_ = 0;
    bool json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_status() {
    return std::make_unique<Status>();
}

} // namespace obscura::tools
