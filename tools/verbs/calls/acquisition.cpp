// SPDX-License-Identifier: Apache-2.0
// Verbs `obscura start` and `obscura stop`: the acquisition of a running camera.
#include "tools/verbs/calls/calling_verb.hpp"

#include <fmt/format.h>

namespace obscura::tools {
namespace {

/// What is different between the two.
struct Change {
    const char *verb, *summary, *description, *call, *member, *done, *was_so;
};

constexpr Change start{
    "start",
    "starts the acquisition of a running camera",
    "From then on triggers make frames. "
    "The daemon itself, and its camera, are started by obscurad or systemctl. "
    "Width, Height, PixelFormat and what else is locked while the camera acquires change only before. "
    "While a GigE Vision client controls the camera the exit status is 75.",
    "camera.start",
    "started",
    "the camera acquires",
    "the camera acquired already"};
constexpr Change stop{
    "stop",
    "stops the acquisition of a running camera",
    "The frame in progress is finished; triggers that come later make none. "
    "The daemon goes on. While a GigE Vision client controls the camera the exit status is 75.",
    "camera.stop",
    "stopped",
    "the camera has stopped",
    "the camera had stopped already"};

class Acquisition final : public CallingVerb {
public:
    explicit Acquisition(const Change& change)
        : CallingVerb(change.verb, DaemonOptions::Has::camera), change_(change) {}

    void declare(host::CommandLine& line) override {
        line.summary = change_.summary;
        line.description = change_.description;
        declare_daemon(line);
        line.examples = {fmt::format("obscura {}", change_.verb),
                         fmt::format("obscura {} --camera 1", change_.verb),
                         "obscura stop && obscura set Width=320 && obscura start"};
    }

    int work() override {
        const host::CallJson answer = connect()->ask(change_.call, daemon().fields());
        fmt::print("{}\n", answer.value(change_.member, false) ? change_.done : change_.was_so);
        return exit_ok;
    }

private:
    const Change& change_;
};

} // namespace

std::unique_ptr<Verb> make_start() {
    return std::make_unique<Acquisition>(start);
}

std::unique_ptr<Verb> make_stop() {
    return std::make_unique<Acquisition>(stop);
}

} // namespace obscura::tools
