// SPDX-License-Identifier: Apache-2.0
// Verb `obscura events`: prints the latest log lines of a running daemon.
#include "core/text/printable.hpp"
#include "core/time.hpp"
#include "host/interrupt.hpp"
#include "host/monitor_client.hpp"
#include "tools/control/rest_client.hpp"
#include "tools/control/url_options.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <ctime>
#include <optional>
#include <string>
#include <vector>

namespace obscura::tools {
namespace {

class Events final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "prints the latest log lines of a running daemon";
        line.description =
            "Prints time (UTC), level and text of what the daemon has written to its log, up to 1024 lines back, oldest first. "
            "Lines have numbers that count from 1 at the daemon's start. "
            "With several daemons on this machine, --socket says which.";
        line.option("--socket", &socket_, "DAEMON", host::which_daemon_help);
        url_.declare(line);
        line.number("--after", &after_, "N", "Only lines with a larger number", 0, 9e15);
        line.flag("--follow", follow_, "Go on with new lines until interrupted");
        line.flag("--json", json_, "Print one JSON object a line, with the line's number as \"id\"");
        line.examples = {"obscura events", "obscura events --follow",
                         "obscura events --follow --url https://bench.example.org:8420"};
    }

    [[nodiscard]] bool runs_until_told() const override { return follow_; }

    int run() override {
        try {
            return ask();
        } catch (const nlohmann::ordered_json::exception& error) {
            throw HardwareError(
                fmt::format("obscura events: the answer is not as expected: {}", error.what()));
        }
    }

private:
    int ask() {
        host::catch_interrupts();
        connect();
        while (!host::interrupted()) {
            if (print()) continue;
            if (!follow_) break;
            const timespec pause{web_ ? 1 : 0, web_ ? 0 : 200 * ns_per_ms};
            nanosleep(&pause, nullptr);
        }
        return exit_ok;
    }

    void connect() {
        if (!url_.given()) {
            daemon_.emplace(host::connect_to_daemon("obscura events", socket_));
            return;
        }
        if (!socket_.empty()) throw host::UsageError("obscura events: --url excludes --socket");
        web_.emplace("events", url_.http("events"));
    }

    [[nodiscard]] std::vector<nlohmann::ordered_json> latest() {
        if (web_) return web_->events(after_);
        const nlohmann::ordered_json answer = daemon_->call("events", {{"after", after_}}).head;
        const auto& events = answer.at("events");
        return {events.begin(), events.end()};
    }

    /// Prints what one answer holds; false: nothing new.
    bool print() {
        const std::vector<nlohmann::ordered_json> events = latest();
        for (const auto& event : events) {
            after_ = event.at("id").get<std::uint64_t>();
            if (json_)
                fmt::print("{}\n", event.dump());
            else
                fmt::print("{} {:<7} {}\n", event.at("utc").get<std::string>(),
                           event.at("level").get<std::string>(),
                           for_terminal(event.at("text").get<std::string>()));
        }
        std::fflush(stdout);
        return !events.empty();
    }

    std::string socket_;
    UrlOptions url_;
    std::optional<host::MonitorClient> daemon_;
    std::optional<RestClient> web_;
    std::uint64_t after_ = 0;
    bool follow_ = false, json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_events() {
    return std::make_unique<Events>();
}

} // namespace obscura::tools
