// SPDX-License-Identifier: Apache-2.0
// Verb `obscura events`: prints the latest log lines of a running daemon.
#include "core/terminal_text.hpp"
#include "core/time.hpp"
#include "tools/support/interrupt.hpp"
#include "tools/support/monitor_client.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <ctime>
#include <string>

namespace obscura::tools {
namespace {

class Events final : public Verb {
public:
    void declare(CommandLine& line) override {
        line.summary = "prints the latest log lines of a running daemon";
        line.description =
            "Prints time (UTC), level and text of what the daemon has written to its log, up to 1024 lines "
            "back, oldest first. Lines have numbers that count from 1 at the daemon's start. With several "
            "daemons on this machine, --socket says which.";
        line.option("--socket", &socket_, "PATH", "Ask the daemon with this socket (its monitor.socket)");
        line.number("--after", &after_, "N", "Only lines with a larger number", 0, 9e15);
        line.flag("--follow", follow_, "Go on with new lines until interrupted");
        line.flag("--json", json_, "Print one JSON object a line, with the line's number as \"id\"");
        line.examples = {"obscura events", "obscura events --follow"};
    }

    int run() override {
        catch_interrupts();
        const MonitorClient daemon = connect_to_daemon("obscura events", socket_);
        while (!interrupted()) {
            if (print(daemon)) continue;
            if (!follow_) break;
            const timespec pause{0, 200 * ns_per_ms};
            nanosleep(&pause, nullptr);
        }
        return exit_ok;
    }

private:
    /// Prints what one answer holds; false: nothing new.
    bool print(const MonitorClient& daemon) {
        const nlohmann::ordered_json answer = daemon.ask({{"verb", "events"}, {"after", after_}});
        const auto& events = answer.at("events");
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
    std::uint64_t after_ = 0;
    bool follow_ = false, json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_events() {
    return std::make_unique<Events>();
}

} // namespace obscura::tools
