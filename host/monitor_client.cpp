// SPDX-License-Identifier: Apache-2.0
#include "host/monitor_client.hpp"

#include "core/error.hpp"
#include "host/monitor_connection.hpp"
#include "host/monitor_paths.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace obscura::host {
namespace {

/// Reports a failed call of a socket that has a timeout.
[[noreturn]] void fail(const std::string& what) {
    if (errno == EAGAIN) throw NoAnswer(fmt::format("{}: no answer within {} s", what, monitor_timeout_s));
    throw HardwareError(fmt::format("{}: {}", what, std::strerror(errno)));
}

/// Calls `visit` with the given socket, or with those of all daemons of this machine. Returns why the last
/// one refused, by a HardwareError of `visit`: it is left over, of another group, or has just gone.
template<typename Visit>
std::string visit_sockets(const std::string& socket, const Visit& visit) {
    std::string refused = no_daemon_here;
    for (const std::filesystem::path& path :
         socket.empty() ? monitor_sockets() : std::vector<std::filesystem::path>{socket}) {
        try {
            visit(path);
        } catch (const HardwareError& error) {
            refused = error.what();
        }
    }
    return refused;
}

} // namespace

MonitorClient::MonitorClient(const std::filesystem::path& socket, bool wait)
    : path_(socket), socket_(connect_to_monitor(socket, wait)) {
    if (!socket_) fail(fmt::format("no daemon answers at {}", socket.string()));
}

nlohmann::ordered_json MonitorClient::ask(const nlohmann::ordered_json& request,
                                          std::vector<FileDescriptor>* descriptors) const {
    const auto refuse = [this](const std::string& why) {
        throw HardwareError(fmt::format("{}: {}", path_.string(), why));
    };
    const std::string text = request.dump();
    std::vector<char> answer(monitor_answer_bytes);
    if (!send_request(socket_.get(), text)) fail(path_.string());
    const ssize_t bytes = receive_answer(socket_.get(), answer, descriptors);
    if (bytes == 0) refuse("the daemon has ended the connection");
    if (bytes < 0) fail(path_.string());
    auto json = nlohmann::ordered_json::parse(answer.begin(), answer.begin() + bytes, nullptr, false);
    if (!json.is_object()) refuse("the answer is no JSON object");
    if (json.contains("error")) refuse(json["error"].dump());
    return json;
}

DaemonStates daemon_states(const std::string& socket) {
    DaemonStates found;
    const std::string refused = visit_sockets(socket, [&found](const std::filesystem::path& path) {
        try {
            found.states.push_back(MonitorClient(path).ask({{"verb", "state"}}));
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
