// SPDX-License-Identifier: Apache-2.0
// Main program obscura-instrument: the cameras of a daemon as an instrument of a test bench.
#include "core/error.hpp"
#include "core/terminal_text.hpp"
#include "emulator/service_notify.hpp"
#include "instrument/scpi/reference.hpp"
#include "instrument/scpi/server.hpp"
#include "tools/support/command_line.hpp"
#include "tools/support/interrupt.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#ifndef OBSCURA_VERSION
#error "OBSCURA_VERSION comes from the build"
#endif

namespace {

using namespace obscura;
using namespace obscura::instrument;

struct Options {
    DaemonAddress daemon{"/run/obscura/calls", {}};
    std::string scpi = "127.0.0.1:5025", scpi_view, describe;
    bool insecure = false, version = false;
};

tools::CommandLine declare(Options& options) {
    tools::CommandLine line;
    line.program = "";
    line.summary = "lets test benches command the cameras of a daemon by SCPI";
    line.description = "Speaks SCPI over TCP and makes of it the calls of a daemon, whose configuration has "
                       "[control]. SCPI knows no passwords: whoever reaches the port may do what the port "
                       "allows, so it listens at the loopback interface.";
    line.option("--control", &options.daemon.address, "ADDRESS",
                "Calls of the daemon: its control.unix_socket, or ADDRESS:PORT of its control.listen");
    line.option("--token-file", &options.daemon.token_file, "FILE", "Token that the daemon wants over TCP");
    line.option("--scpi", &options.scpi, "ADDRESS:PORT",
                "Listen here for clients that may change the cameras; port 0: any free one; off: not at all");
    line.option("--scpi-view", &options.scpi_view, "ADDRESS:PORT",
                "Listen here for clients that may only ask");
    line.flag("--insecure", options.insecure,
              "Allow addresses that are not of the loopback interface: whoever can reach them may do what "
              "they allow");
    line.option("--describe", &options.describe, "WHAT", "Print a description and end").choices = {"scpi"};
    line.flag("--version", options.version, "Print the version and end");
    line.examples = {"obscura-instrument",
                     "obscura-instrument --control 127.0.0.1:5153 --scpi 127.0.0.1:5025",
                     "echo '*IDN?' | nc -N 127.0.0.1 5025"};
    return line;
}

bool is_loopback(const std::string& address) {
    return address.starts_with("127.") || address.starts_with("localhost:");
}

void open(std::vector<ScpiPort>& ports, const Options& options, const char* option,
          const std::string& address, bool may_change) {
    if (address.empty() || address == "off") return;
    if (!is_loopback(address) && !options.insecure)
        throw ConfigError(fmt::format(
            "obscura-instrument: {} {}: not of the loopback interface, and SCPI knows no passwords. Use a "
            "tunnel (ssh -L 5025:127.0.0.1:5025 HOST), or --insecure in a laboratory network of its own",
            option, address));
    ports.push_back({service::Listener::tcp(address, options.insecure), may_change});
    fmt::print("{} {}\n", option + 2, ports.back().listener.address());
}

int serve(const Options& options) {
    std::vector<ScpiPort> ports;
    open(ports, options, "--scpi", options.scpi, true);
    open(ports, options, "--scpi-view", options.scpi_view, false);
    if (ports.empty()) throw tools::UsageError("obscura-instrument: --scpi off: nothing is left to do");
    std::fflush(stdout);
    ScpiServer server(ScpiLimits{}, options.daemon, OBSCURA_VERSION, std::move(ports));
    emulator::notify_service_manager("READY=1");
    server.run([] { return tools::interrupted(); });
    emulator::notify_service_manager("STOPPING=1");
    return exit_ok;
}

int run(const std::vector<std::string>& arguments) {
    Options options;
    if (!declare(options).parse("obscura-instrument", arguments)) return exit_ok;
    if (options.version) {
        fmt::print("obscura-instrument {}\n", OBSCURA_VERSION);
        return exit_ok;
    }
    if (!options.describe.empty()) {
        fmt::print("{}", scpi_reference());
        return exit_ok;
    }
    tools::catch_interrupts();
    return serve(options);
}

} // namespace

int main(int argc, char* argv[]) {
    try {
        return run(std::vector<std::string>(argv + 1, argv + argc));
    } catch (const Error& error) {
        fmt::print(stderr, "{}\n", for_terminal(error.what()));
        return error.status();
    } catch (const std::exception& error) {
        fmt::print(stderr, "obscura-instrument: internal error: {}\n", for_terminal(error.what()));
        return exit_software;
    }
}
