// SPDX-License-Identifier: Apache-2.0
// Verb `obscura metrics`: prints what running daemons have counted in the text format of Prometheus.
#include "images/writers/pending_file.hpp"
#include "tools/support/metrics_text.hpp"
#include "tools/support/monitor_client.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>

#include <fstream>
#include <string>
#include <vector>

namespace obscura::tools {
namespace {

class Metrics final : public Verb {
public:
    void declare(CommandLine& line) override {
        line.summary = "prints counters and latencies of running daemons for Prometheus";
        line.description =
            "Asks every daemon of this machine that this user may ask and prints triggers, frames, rows, "
            "latencies, transports and threads in the text format of Prometheus. With --output the file "
            "appears "
            "whole, as node_exporter's textfile collector wants it: run it by a timer. The exit status is 69 "
            "if no daemon answers, and no file is written then. docs/monitor.md lists the names.";
        line.option("--socket", &socket_, "PATH",
                    "Ask the daemon with this socket (its monitor.socket) only");
        line.option("-o,--output", &output_, "FILE", "Write to this file instead of standard output");
        line.examples = {"obscura metrics",
                         "obscura metrics -o /var/lib/prometheus/node-exporter/obscura.prom"};
    }

    int run() override {
        std::vector<nlohmann::ordered_json> states;
        for (const MonitorClient& daemon : connect_to_daemons(socket_))
            states.push_back(daemon.ask({{"verb", "state"}}));
        const std::string text = metrics_text(states);
        if (output_.empty()) {
            fmt::print("{}", text);
            return exit_ok;
        }
        images::PendingFile file(output_);
        std::ofstream out(file.path(), std::ios::binary);
        out << text;
        out.close();
        if (!out) file.fail("no room, or no right to write");
        file.commit();
        return exit_ok;
    }

private:
    std::string socket_, output_;
};

} // namespace

std::unique_ptr<Verb> make_metrics() {
    return std::make_unique<Metrics>();
}

} // namespace obscura::tools
