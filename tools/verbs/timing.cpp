// SPDX-License-Identifier: Apache-2.0
// Verb `obscura timing`: latency statistics of a run, and self-test of the machine's release jitter.
#include "emulator/unit/release_self_test.hpp"
#include "images/writers/raw.hpp"
#include "tools/timing/timing_report.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <fstream>

namespace obscura::tools {
namespace {

class Timing final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "evaluates the latencies of a run, or the release jitter of this machine";
        line.description =
            "Reads the time stamps that `obscurad --timing FILE` wrote and prints the latency of each stage, from the trigger edge to the last byte of every transport, and the lateness of each row: quantiles, histograms, and the ten worst frames with the stage that delayed them. "
            "For the late frames it says where the time went (scene at motion instants, samples, wings, detector, other programs, ...), which setting decides that, and what a frame would take with another value. "
            "Frames that were rendered below full quality (deadline.quality) are counted by reason, and with --degraded listed one by one. "
            "Each acquisition has tables of its own. "
            "The output is text, CSV, or a picture of the distributions (SVG). "
            "With --self-test no file is read: the daemon's row release thread releases rows at 10 and 100 Hz, with and without polling, and their lateness is printed.";
        line.positional("FILE", &file_, "Timing file that obscurad --timing wrote").required = false;
        line.option("--format", &format_, "FORMAT", "Output format").choices = {"text", "csv", "svg"};
        line.option("-o,--output", &output_, "FILE", "Write to FILE instead of standard output");
        line.flag("--degraded", degraded_,
                  "Also list each degraded frame: levels, errors, times and reasons");
        line.flag("--self-test", self_test_,
                  "Measure the release jitter of this machine instead of reading FILE");
        line.number("--seconds", &seconds_, "S", "With --self-test: duration of each measurement in seconds",
                    0.1, 3600);
        line.examples = {"obscura timing run.csv    # after: obscurad --config FILE --timing run.csv",
                         "obscura timing run.csv --format svg -o run.svg", "obscura timing --self-test"};
    }

    int run() override {
        if (self_test_ != file_.empty())
            throw host::UsageError("obscura timing: either FILE or --self-test is wanted, not both");
        write(self_test_ ? text_of(emulator::release_self_test(seconds_, true)) : report());
        return exit_ok;
    }

private:
    std::string report() const {
        std::ifstream in(file_);
        if (!in) throw InputError(fmt::format("{}: cannot be opened", file_), errno);
        const TimingFile run = read_timing(in, file_);
        if (format_ == "csv") return timing_csv(run);
        if (format_ == "svg") return timing_svg(run);
        return timing_text(run, degraded_);
    }

    void write(const std::string& text) const {
        if (output_.empty()) {
            std::fputs(text.c_str(), stdout);
            return;
        }
        images::write_text(output_, text);
    }

    std::string file_, format_ = "text", output_;
    bool self_test_ = false, degraded_ = false;
    double seconds_ = 5;
};

} // namespace

std::unique_ptr<Verb> make_timing() {
    return std::make_unique<Timing>();
}

} // namespace obscura::tools
