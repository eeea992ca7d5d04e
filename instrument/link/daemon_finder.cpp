// SPDX-License-Identifier: Apache-2.0
#include "instrument/link/daemon_finder.hpp"

#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "host/monitor_client.hpp"
#include "instrument/link/camera_link.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <system_error>

namespace obscura::instrument {
namespace {

/// Socket of the packaged service.
constexpr const char* service_calls = "/run/obscura/calls";

LinkError not_found(const std::string& why) {
    return {"connection-lost", "", why};
}

} // namespace

std::string find_calls(const std::string& socket) {
    try {
        const nlohmann::ordered_json state =
            host::connect_to_daemon("obscura-instrument", socket).call("state").head;
        const auto& daemon = state.at("daemon");
        if (daemon.contains("starting"))
            throw not_found("the daemon is " + daemon["starting"].at("text").get<std::string>());
        if (auto address = daemon.at("control").get<std::string>(); !address.empty()) return address;
        throw not_found(fmt::format("the daemon takes no calls: set control.unix_socket in {}",
                                    daemon.at("config").get<std::string>()));
    } catch (const nlohmann::json::exception& error) {
        throw not_found(fmt::format("the daemon's answer is not as expected: {}", error.what()));
    } catch (const Error& error) { // none, or several
        if (socket.empty() && path_exists(service_calls)) return service_calls;
        throw not_found(error.what());
    }
}

} // namespace obscura::instrument
