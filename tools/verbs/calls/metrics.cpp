// SPDX-License-Identifier: Apache-2.0
// Verb `obscura metrics`: prints what running daemons have counted in the text format of Prometheus.
#include "core/text/printable.hpp"
#include "host/metrics_text.hpp"
#include "host/monitor_client.hpp"
#include "images/writers/raw.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>

#include <string>
#include <vector>

namespace obscura::tools {
namespace {

class Metrics final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "prints counters and latencies of running daemons for Prometheus";
        line.description =
            "Asks every daemon of this machine that this user may ask and prints triggers, frames, rows, latencies, transports and threads in the text format of Prometheus. "
            "With --output the file appears whole, as node_exporter's textfile collector wants it: run it by a timer. "
            "The exit status is 69 if no daemon answers, and no file is written then; "
            "also if one of several does not answer within 5 s, and the rest is written. docs/control.md lists the names.";
        line.option("--socket", &socket_, "DAEMON", host::which_daemon_help);
        line.option("-o,--output", &output_, "FILE", "Write to this file instead of standard output");
        line.examples = {"obscura metrics",
                         "obscura metrics -o /var/lib/prometheus/node-exporter/obscura.prom"};
    }

    int run() override {
        const host::DaemonStates daemons = host::daemon_states(socket_);
        const std::string text = host::metrics_text(daemons.states);
        if (output_.empty())
            fmt::print("{}", text);
        else
            images::write_text(output_, text);
        for (const std::string& silent : daemons.silent)
            print_message(fmt::format("obscura metrics: {}", silent));
        return daemons.silent.empty() ? exit_ok : exit_hardware;
    }

private:
    std::string socket_, output_;
};

} // namespace

std::unique_ptr<Verb> make_metrics() {
    return std::make_unique<Metrics>();
}

} // namespace obscura::tools
