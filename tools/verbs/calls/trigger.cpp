// SPDX-License-Identifier: Apache-2.0
// Verb `obscura trigger`: triggers frames of a running camera, by software or by datagrams.
#include "core/text/printable.hpp"
#include "host/interrupt.hpp"
#include "sync/sources/udp.hpp"
#include "tools/receive/udp_trigger.hpp"
#include "tools/verbs/calls/calling_verb.hpp"

#include <fmt/format.h>

#include <cmath>
#include <ctime>
#include <string>

namespace obscura::tools {
namespace {

class Trigger final : public CallingVerb {
public:
    Trigger() : CallingVerb("trigger", DaemonOptions::Has::camera) {}

    void declare(host::CommandLine& line) override {
        line.summary = "triggers frames of a running camera";
        line.description =
            "Without --udp, --rate, --first and --stamp: a software trigger of the camera, which must have TriggerSource Software. "
            "Waits for the frame and prints its number, what became of it, its late rows and the time from trigger to last row; "
            "the exit status is 1 if a frame is not complete and on time, 75 while a GigE Vision client controls the camera. "
            "With one of them: datagrams for a daemon with [trigger] source = \"udp\", each an edge on Line0 as a wire would bring it; "
            "what becomes of those tells `obscura status`. "
            "A datagram has 16 bytes, big endian: the letters OBTR, a 32-bit number that counts from 1 (a gap: lost triggers), and the edge's instant in ns of TAI (64 bits; "
            "0: the datagram's arrival).";
        line.number("--frames", &frames_, "N", "Number of triggers; 0: until interrupted", 0, 4e9);
        declare_daemon(line);
        line.flag("--json", json_, "Software trigger: print the answer as one JSON object a line");
        line.option(
            "--udp", &address_, "HOST:PORT",
            "Send datagrams to the IPv4 address and port that the daemon listens on (default with --rate, --first or --stamp: 127.0.0.1:5002)");
        line.number("--rate", &rate_hz_, "HZ", "Datagrams: triggers per second (default: 1)", 0.001, 100'000);
        line.number("--first", &first_, "N", "Datagrams: number of the first one (default: 1)", 1, 4e9);
        line.flag("--stamp", stamp_,
                  "Datagrams: give each the instant of its sending by CLOCK_TAI; "
                  "on another machine only with both clocks synchronised");
        line.examples = {"obscura set TriggerMode=On TriggerSource=Software && obscura trigger",
                         "obscura trigger --frames 10 --json",
                         "obscura trigger --udp 192.168.1.20:5002 --rate 10 --frames 100",
                         "obscura trigger --rate 5 --frames 12    # datagrams to 127.0.0.1:5002"};
    }

protected:
    int work() override {
        if (!address_.empty() || !std::isnan(rate_hz_) || !std::isnan(first_) || stamp_)
            return send_datagrams();
        const auto calls = connect();
        bool good = true;
        for (std::uint32_t done = 0; (frames_ == 0 || done < frames_) && !host::interrupted(); ++done) {
            if (done > 0) wait_until_ready(*calls);
            const host::CallJson answer = calls->ask("camera.trigger", daemon().fields());
            print(answer);
            good = good && answer.value("outcome", std::string()) == "complete";
        }
        return good ? exit_ok : exit_failure;
    }

private:
    [[nodiscard]] int send_datagrams() const {
        const std::string address = address_.empty() ? sync::UdpKind{}.listen : address_;
        UdpTriggers triggers{.address = address, .frames = frames_, .stamped = stamp_};
        if (!std::isnan(rate_hz_)) triggers.rate_hz = rate_hz_;
        if (!std::isnan(first_)) triggers.first = static_cast<std::uint32_t>(first_);
        const std::uint32_t sent = send_triggers(triggers);
        fmt::print("{} trigger{} sent to {}\n", sent, sent == 1 ? "" : "s", address);
        return exit_ok;
    }

    /// The sensor may still read out the frame before.
    void wait_until_ready(host::DaemonCalls& calls) const {
        const host::CallJson::json_pointer ready(fmt::format("/cameras/{}/trigger_ready", daemon().camera()));
        constexpr int max_polls = 600; // one a tick of the daemon: a minute
        for (int i = 0; i < max_polls; ++i)
            if (calls.ask("state", host::CallJson::object()).value(ready, true)) return;
    }

    void print(const host::CallJson& answer) const {
        if (json_) {
            fmt::print("{}\n", answer.dump());
        } else if (const std::string outcome = for_terminal(answer.value("outcome", std::string()));
                   !answer.contains("frame")) {
            fmt::print("no frame: {}{}\n", outcome,
                       answer.value("accepted", true) ? "" : ", the camera was not ready");
        } else {
            const auto late_rows = answer.value("late_rows", std::uint64_t{0});
            fmt::print("frame {}: {}, {} late row{}, {:.4g} ms from trigger to last row\n",
                       answer.value("frame", std::uint64_t{0}), outcome, late_rows, late_rows == 1 ? "" : "s",
                       1e3 * answer.value("seconds", 0.0));
        }
        std::fflush(stdout);
    }

    std::string address_;
    double rate_hz_ = std::nan(""), first_ = std::nan(""); ///< NaN: not given
    std::uint32_t frames_ = 1;
    bool stamp_ = false, json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_trigger() {
    return std::make_unique<Trigger>();
}

} // namespace obscura::tools
