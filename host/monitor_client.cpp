// SPDX-License-Identifier: Apache-2.0
#include "host/monitor_client.hpp"

#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "host/monitor_paths.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

namespace obscura::host {
namespace {

constexpr double monitor_timeout_s = 5;

/// Calls `work`, and tells what it throws as an error of the daemon at `path`.
template<typename Work>
auto at_daemon(const std::filesystem::path& path, const Work& work) {
    const auto begin = std::chrono::steady_clock::now();
    try {
        return work();
    } catch (const CallRefused& refused) {
        throw HardwareError(fmt::format("{}: {}", path.string(), refused.what()));
    } catch (const HardwareError&) {
        const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin;
        if (spent.count() >= monitor_timeout_s)
            throw NoAnswer(fmt::format("{}: no answer within {} s", path.string(), monitor_timeout_s));
        const std::string why = refusal_of_socket(path);
        throw HardwareError(why.empty()
                                ? fmt::format("{}: the daemon has ended the connection", path.string())
                                : fmt::format("no daemon answers at {}: {}", path.string(), why));
    }
}

CallClient connected_client(const std::filesystem::path& socket) {
    CallClient::Options options;
    options.timeout_s = options.connect_timeout_s = monitor_timeout_s;
    return at_daemon(socket, [&] { return CallClient(socket.string(), options); });
}

/// Name of a daemon: its configuration's file without folder and ending.
std::string name_of_daemon(const std::filesystem::path& socket) {
    const nlohmann::ordered_json state = MonitorClient(socket).call("state").head;
    const nlohmann::ordered_json::json_pointer config("/daemon/config");
    return std::filesystem::path(state.value(config, std::string())).stem().string();
}

/// Sockets of the daemons that are meant; `refused`: what to say if there are none.
std::vector<std::filesystem::path> sockets_of(const std::string& daemon, std::string& refused) {
    if (daemon.empty()) return monitor_sockets();
    if (daemon.find('/') != std::string::npos || path_exists(daemon)) return {daemon};
    std::vector<std::filesystem::path> meant;
    std::string names;
    for (const std::filesystem::path& path : monitor_sockets()) {
        try {
            const std::string name = name_of_daemon(path);
            if (name == daemon) meant.push_back(path);
            names += (names.empty() ? "" : ", ") + name;
        } catch (const HardwareError&) { // left over, of another group, or silent
        }
    }
    refused = fmt::format("no daemon here has the configuration {}{}", daemon,
                          names.empty() ? "" : "; there are " + names);
    return meant;
}

/// Calls `visit` with the sockets of the daemons that are meant: a path, the name of a configuration, or
/// empty: all of this machine. Returns why the last one refused, by a HardwareError of `visit`: it is left
/// over, of another group, or has just gone.
template<typename Visit>
std::string visit_sockets(const std::string& socket, const Visit& visit) {
    std::string refused = no_daemon_here;
    for (const std::filesystem::path& path : sockets_of(socket, refused)) {
        try {
            visit(path);
        } catch (const HardwareError& error) {
            refused = error.what();
        }
    }
    return refused;
}

} // namespace

std::string refusal_of_socket(const std::filesystem::path& socket) {
    const std::string& text = socket.native();
    if (text.size() > max_socket_path_bytes()) return std::strerror(ENAMETOOLONG);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    text.copy(address.sun_path, text.size());
    const FileDescriptor probe(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    if (!probe) return std::strerror(errno);
    // EAGAIN: it has not accepted those before.
    if (::connect(probe.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ||
        errno == EAGAIN)
        return {};
    return errno == EPROTOTYPE ? "an obscurad of an earlier version" : std::strerror(errno);
}

MonitorClient::MonitorClient(const std::filesystem::path& socket)
    : path_(socket), client_(connected_client(socket)) {}

CallClient::Answer MonitorClient::call(const std::string& name, const nlohmann::ordered_json& fields) {
    return at_daemon(path_, [&] { return client_.call(name, fields); });
}

DaemonStates daemon_states(const std::string& socket) {
    DaemonStates found;
    const std::string refused = visit_sockets(socket, [&found](const std::filesystem::path& path) {
        try {
            found.states.push_back(MonitorClient(path).call("state").head);
        } catch (const NoAnswer& error) {
            found.silent.emplace_back(error.what());
        }
    });
    if (found.states.empty())
        throw HardwareError(found.silent.empty() ? refused
                                                 : fmt::format("{}", fmt::join(found.silent, "; ")));
    return found;
}

MonitorClient connect_to_daemon(const std::string& program, const std::string& socket) {
    std::vector<MonitorClient> daemons;
    const std::string refused =
        visit_sockets(socket, [&daemons](const std::filesystem::path& path) { daemons.emplace_back(path); });
    if (daemons.empty()) throw HardwareError(fmt::format("{}: {}", program, refused));
    if (daemons.size() == 1) return std::move(daemons.front());
    std::string paths;
    for (const MonitorClient& one : daemons)
        paths += fmt::format("{}{}", paths.empty() ? "" : ", ", one.path().string());
    throw Error(exit_usage, fmt::format("{}: {} daemons run here, choose one with --socket: {}", program,
                                        daemons.size(), paths));
}

} // namespace obscura::host
