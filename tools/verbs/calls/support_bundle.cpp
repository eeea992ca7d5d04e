// SPDX-License-Identifier: Apache-2.0
// Verb `obscura support-bundle`: one file with what a maintainer wants to know.
#include "host/support_bundle.hpp"

#include "emulator/unit/release_self_test.hpp"
#include "host/monitor_client.hpp"
#include "tools/verbs/calls/calling_verb.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <ctime>
#include <string>

#ifndef OBSCURA_VERSION
#error "OBSCURA_VERSION comes from the build"
#endif

namespace obscura::tools {
namespace {

class SupportBundleVerb final : public CallingVerb {
public:
    SupportBundleVerb() : CallingVerb("support-bundle", DaemonOptions::Has::daemon) {}

    void declare(host::CommandLine& line) override {
        line.summary = "saves what a maintainer wants to know of this machine and its daemon";
        line.description =
            "Writes one archive with versions, kernel and its command line, the daemon's configuration with the place each value comes from, its state, counters, threads and log, settings, faults and time stamps of the newest frames of each camera, and how late this machine releases rows. "
            "No frames, no scene files, no tokens; look into it before you send it: tar --zstd -xf FILE. "
            "Without a daemon, or one that takes no calls, it has the rest, says what is missing, and the exit status is 1.";
        line.option("-o,--output", &output_, "FILE",
                    "File to write (default: obscura-support-HOST-TIME.tar.zst in this folder)");
        declare_daemon(line);
        line.flag(
            "--self-test", self_test_,
            "Measure row release with real-time priority also while a camera acquires, which it may make late (default: then with ordinary scheduling)");
        line.examples = {"obscura support-bundle", "obscura support-bundle -o /tmp/bench.tar.zst",
                         "sudo obscura support-bundle    # for the daemon of the service"};
    }

protected:
    int work() override {
        const std::time_t now = std::time(nullptr);
        std::array<char, 65> host{};
        ::gethostname(host.data(), host.size() - 1);
        const std::string stem =
            fmt::format("obscura-support-{:.40}-{:%Y%m%dT%H%M%SZ}", host.data(), fmt::gmtime(now));
        host::TarArchive archive(stem, now);
        host::SupportBundle bundle(archive);
        add_machine(bundle, OBSCURA_VERSION);
        const std::size_t acquiring = add_what_daemon_tells(bundle);
        const bool realtime = self_test_ || acquiring == 0;
        host::add_self_test(bundle,
                            [realtime] { return text_of(emulator::release_self_test(0.3, realtime)); });
        bundle.finish();
        const std::string file = output_.empty() ? stem + ".tar.zst" : output_;
        archive.write(file);
        fmt::print("{}: {} files\n", file, bundle.files());
        for (const std::string& one : bundle.missing())
            fmt::print("missing: {}\n", one);
        return bundle.missing().empty() ? exit_ok : exit_failure;
    }

private:
    /// Asks by calls, else through the monitor socket. Returns the number of cameras that acquire.
    std::size_t add_what_daemon_tells(host::SupportBundle& bundle) const {
        try {
            const auto calls = connect();
            return add_daemon(
                bundle,
                [&](const std::string& call, const host::CallJson& fields) {
                    return calls->ask(call, fields);
                },
                true);
        } catch (const host::Interrupted&) {
            throw;
        } catch (const Error& error) {
            if (error.status() == exit_usage) throw; // several daemons, for example
            bundle.note_missing("calls of the daemon", error.what());
        }
        if (daemon().over_web()) return 0; // a daemon of this machine is another one
        try {
            host::MonitorClient monitor =
                host::connect_to_daemon("obscura support-bundle", daemon().socket());
            return add_daemon(
                bundle,
                [&](const std::string& call, const host::CallJson& fields) {
                    return monitor.call(call, fields).head;
                },
                false);
        } catch (const Error& error) {
            bundle.note_missing("daemon", error.what());
            return 0;
        }
    }

    std::string output_;
    bool self_test_ = false;
};

} // namespace

std::unique_ptr<Verb> make_support_bundle() {
    return std::make_unique<SupportBundleVerb>();
}

} // namespace obscura::tools
