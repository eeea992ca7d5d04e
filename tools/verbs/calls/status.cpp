// SPDX-License-Identifier: Apache-2.0
// Verb `obscura status`: shows what running daemons do.
#include "core/text/printable.hpp"
#include "host/interrupt.hpp"
#include "host/monitor_client.hpp"
#include "tools/control/rest_client.hpp"
#include "tools/control/url_options.hpp"
#include "tools/pages/status_text.hpp"
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
    void declare(host::CommandLine& line) override {
        line.summary = "shows what the cameras of running daemons do";
        line.description =
            "Asks every daemon of this machine that this user may ask, its own and those of services whose group (obscura) the user is in, and prints for each camera one line on whether it does what it should, who controls it, its trigger source, counters and latencies. "
            "The exit status is 0 if every camera is on time or idle, 1 if one is neither, with the first reason in its line, and 69 if no daemon answers, or one of several does not within 5 s. "
            "With --watch it goes on when a daemon ends, and shows the next one.";
        line.option("--socket", &socket_, "DAEMON", host::which_daemon_help);
        url_.declare(line);
        line.number("--watch", &watch_s_, "SECONDS",
                    "Show it again every SECONDS, 1 if that is not said, until interrupted; 0: once", 0, 3600)
            .without_value = "1";
        line.flag("--json", json_, "Print one JSON object a line for each daemon, as docs/control.md says");
        line.examples = {"obscura status", "obscura status --watch",
                         "obscura status --json | jq '.cameras[0].recent'",
                         "obscura status --url https://bench.example.org:8420"};
    }

    [[nodiscard]] bool runs_until_told() const override { return watch_s_ > 0; }

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
        host::catch_interrupts();
        if (url_.given()) {
            if (!socket_.empty()) throw host::UsageError("obscura status: --url excludes --socket");
            web_.emplace("status", url_.http("status"));
        }
        int status = show();
        while (watch_s_ > 0) {
            wait();
            if (host::interrupted()) break;
            try {
                status = show();
            } catch (const HardwareError& error) { // a daemon that is started again comes back
                status = error.status();
                print("", {error.what()});
            }
        }
        return status;
    }

    [[nodiscard]] host::DaemonStates states() {
        if (web_) return {web_->states(), {}};
        return host::daemon_states(socket_);
    }

    /// Returns the exit status.
    [[nodiscard]] int show() {
        bool good = true;
        std::string text;
        const host::DaemonStates daemons = states();
        for (const nlohmann::ordered_json& state : daemons.states) {
            text += json_ ? state.dump() + "\n" : status_text(state);
            good = none_bad(state) && good;
        }
        print(text, daemons.silent);
        if (!daemons.silent.empty()) return exit_hardware;
        return good ? exit_ok : exit_failure;
    }

    void print(const std::string& text, const std::vector<std::string>& complaints) const {
        // On a terminal each round replaces the one before.
        const bool replace = watch_s_ > 0 && !json_ && ::isatty(STDOUT_FILENO) != 0;
        fmt::print("{}{}", replace ? "\033[H\033[2J" : "", text);
        std::fflush(stdout);
        for (const std::string& line : complaints)
            print_message(fmt::format("obscura status: {}", line));
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
