// SPDX-License-Identifier: Apache-2.0
// Main program obscura-instrument: the cameras of a daemon as an instrument of a test bench.
#include "core/error.hpp"
#include "core/io/address_range.hpp"
#include "core/text/printable.hpp"
#include "host/command_line.hpp"
#include "host/interrupt.hpp"
#include "host/monitor_client.hpp"
#include "host/service_notify.hpp"
#include "host/standard_output.hpp"
#include "instrument/link/admission.hpp"
#include "instrument/link/daemon_finder.hpp"
#include "instrument/lxi/server.hpp"
#include "instrument/packets/descriptions.hpp"
#include "instrument/packets/service.hpp"
#include "instrument/scpi/reference.hpp"
#include "instrument/scpi/server.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#ifndef OBSCURA_VERSION
#error "OBSCURA_VERSION comes from the build"
#endif

namespace {

using namespace obscura;
using namespace obscura::instrument;

struct Options {
    DaemonAddress daemon;
    std::string socket;
    std::string scpi = "127.0.0.1:5025", scpi_view, describe;
    std::string telemetry, telecommands, lxi, allow;
    std::uint32_t apid = 256;
    bool insecure = false, version = false;
};

host::CommandLine declare(Options& options) {
    host::CommandLine line;
    line.program = "";
    line.summary = "lets test benches command the cameras of a daemon by SCPI and space packets";
    line.description =
        "Speaks SCPI over TCP and CCSDS space packets over UDP, and makes of them the calls of a daemon, whose configuration has [control]. "
        "Neither has passwords: every program that reaches a port may use it, so it listens at the loopback interface.";
    line.option("--socket", &options.socket, "DAEMON", host::which_daemon_help);
    line.option(
        "--control", &options.daemon.address, "ADDRESS",
        "Call the daemon at its control.unix_socket, or ADDRESS:PORT of its control.listen, without looking for it");
    line.option("--token-file", &options.daemon.token_file, "FILE", "Token that the daemon wants over TCP");
    line.option("--scpi", &options.scpi, "ADDRESS:PORT",
                "Listen here for clients that may change the cameras; port 0: any free one; off: not at all");
    line.option("--scpi-view", &options.scpi_view, "ADDRESS:PORT",
                "Listen here for clients that may only ask");
    line.option("--telemetry", &options.telemetry, "ADDRESS:PORT",
                "Send telemetry packets there: housekeeping once a second, a report of each frame");
    line.option("--telecommands", &options.telecommands, "ADDRESS:PORT",
                "Take telecommand packets here; port 0: any free one");
    line.option("--lxi", &options.lxi, "ADDRESS:PORT",
                "Serve the LXI identification over HTTP here, at /lxi/identification");
    line.number("--apid", &options.apid, "N", "First of the four APIDs of the packets", 1, 2036);
    line.option(
        "--allow", &options.allow, "LIST",
        "Other machines that may come, like 192.168.7.20,192.168.8.0/24: with it the ports may be of other addresses than the loopback interface's");
    line.flag(
        "--insecure", options.insecure,
        "Allow those addresses without a list: every client that can reach them may do what they allow");
    line.option("--describe", &options.describe, "WHAT", "Print a description and end").choices = {
        "scpi", "packets", "xtce", "cosmos-telemetry", "cosmos-commands"};
    line.flag("--version", options.version, "Print the version and end");
    line.examples = {"obscura-instrument",
                     "obscura-instrument --control 127.0.0.1:5153 --scpi 127.0.0.1:5025",
                     "obscura-instrument --scpi 192.168.7.5:5025 --allow 192.168.7.20",
                     "echo '*IDN?' | nc -N 127.0.0.1 5025"};
    return line;
}

bool is_loopback(const std::string& address) {
    return address.starts_with("127.") || address.starts_with("localhost:");
}

void check_reach(const Options& options, const char* option, const std::string& address) {
    if (is_loopback(address) || options.insecure || !options.allow.empty()) return;
    throw ConfigError(fmt::format(
        "obscura-instrument: {} {}: not of the loopback interface, and there are no passwords. "
        "Name the machines that may come (--allow 192.168.7.20), or use a tunnel (ssh -L 5025:127.0.0.1:5025 HOST)",
        option, address));
}

/// Throws UsageError.
Admission admission_of(const Options& options) {
    try {
        std::vector<AddressRange> allowed = parse_address_ranges(options.allow);
        if (allowed.empty() && !options.allow.empty()) throw ConfigError("it names no address");
        return Admission(std::move(allowed));
    } catch (const ConfigError& error) {
        throw host::UsageError(fmt::format("obscura-instrument: --allow: {}", error.what()));
    }
}

service::Listener listen(const Options& options, const char* option, const std::string& address) {
    check_reach(options, option, address);
    service::Listener listener = service::Listener::tcp(address, !is_loopback(address));
    fmt::print("{} {}\n", option + 2, listener.address());
    return listener;
}

int serve(const Options& options) {
    const Admission admission = admission_of(options);
    std::vector<ScpiPort> ports;
    if (options.scpi != "off") ports.push_back({listen(options, "--scpi", options.scpi), true});
    if (!options.scpi_view.empty())
        ports.push_back({listen(options, "--scpi-view", options.scpi_view), false});
    std::optional<LxiServer> lxi;
    if (!options.lxi.empty())
        lxi.emplace(listen(options, "--lxi", options.lxi), OBSCURA_VERSION,
                    ports.empty() ? std::uint16_t{0} : service::port_of(ports.front().listener), admission);
    std::optional<PacketService> packets;
    if (!options.telemetry.empty() || !options.telecommands.empty()) {
        if (!options.telecommands.empty()) check_reach(options, "--telecommands", options.telecommands);
        packets.emplace(
            PacketOptions{options.telemetry, options.telecommands, static_cast<std::uint16_t>(options.apid)},
            options.daemon, admission);
        if (!packets->telecommand_address().empty())
            fmt::print("telecommands {}\n", packets->telecommand_address());
    }
    if (ports.empty() && !packets)
        throw host::UsageError("obscura-instrument: --scpi off: nothing is left to do");
    std::fflush(stdout);
    ScpiServer server(ScpiLimits{}, options.daemon, OBSCURA_VERSION, std::move(ports), admission);
    std::vector<std::jthread> others; // they end with this function, however it ends
    const auto beside = [&others](auto& service) {
        others.emplace_back([&service](const std::stop_token& stop) {
            service.run([&stop] { return stop.stop_requested() || host::interrupted(); });
        });
    };
    if (packets) beside(*packets);
    if (lxi) beside(*lxi);
    host::notify_service_manager("READY=1");
    server.run(host::interrupted);
    host::notify_service_manager("STOPPING=1");
    return exit_ok;
}

std::string description(const Options& options) {
    const auto apid = static_cast<std::uint16_t>(options.apid);
    if (options.describe == "packets") return packet_page(apid);
    if (options.describe == "xtce") return xtce_description(apid);
    if (options.describe == "cosmos-telemetry") return cosmos_telemetry(apid);
    if (options.describe == "cosmos-commands") return cosmos_commands(apid);
    return scpi_reference();
}

int run(const std::vector<std::string>& arguments) {
    Options options;
    if (!declare(options).parse("obscura-instrument", arguments)) return exit_ok;
    if (options.version) {
        fmt::print("obscura-instrument {}\n", OBSCURA_VERSION);
        return exit_ok;
    }
    if (!options.describe.empty()) {
        fmt::print("{}", description(options));
        return exit_ok;
    }
    if (!options.socket.empty() && !options.daemon.address.empty())
        throw host::UsageError("obscura-instrument: --control excludes --socket");
    options.daemon.find = [socket = options.socket] { return find_calls(socket); };
    host::catch_interrupts();
    return serve(options);
}

} // namespace

int main(int argc, char* argv[]) {
    try {
        return host::with_standard_output(
            [&] { return run(std::vector<std::string>(argv + 1, argv + argc)); });
    } catch (const Error& error) {
        print_message(error.what());
        return error.status();
    } catch (const std::exception& error) {
        print_message(fmt::format("obscura-instrument: internal error: {}", error.what()));
        return exit_software;
    }
}
