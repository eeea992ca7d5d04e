// SPDX-License-Identifier: Apache-2.0
#include "tools/control/daemon_options.hpp"

#include "host/monitor_client.hpp"
#include "tools/control/native_calls.hpp"

#include <fmt/format.h>

#include <array>
#include <utility>

namespace obscura::tools {

void DaemonOptions::declare(host::CommandLine& line, Has has) {
    if (has == Has::camera)
        line.number("--camera", &camera_, "N", "Number of the camera, where the daemon has several", 0, 1000);
    line.option("--socket", &socket_, "DAEMON", host::which_daemon_help);
    line.option(
        "--control", &control_, "ADDRESS",
        "Call the daemon at its control.unix_socket or control.listen, a path or HOST:PORT, without looking for it");
    url_.declare(line, "File of the token that a daemon with control.token_file wants; ");
}

std::string DaemonOptions::control_address(std::string_view verb) const {
    if (!control_.empty()) return control_;
    const host::CallJson state =
        host::connect_to_daemon(fmt::format("obscura {}", verb), socket_).call("state").head;
    const host::CallJson daemon = state.value("daemon", host::CallJson::object());
    const std::string address = daemon.value("control", std::string());
    if (address.empty())
        throw HardwareError(
            fmt::format("obscura {}: the daemon takes no calls: set control.unix_socket in {}", verb,
                        daemon.value("config", std::string("its configuration"))));
    return address;
}

std::unique_ptr<host::DaemonCalls> DaemonOptions::connect(std::string_view verb, double timeout_s) const {
    if (!url_.given()) return connect_natively(verb, control_address(verb), {timeout_s, url_.token_file()});
    if (!control_.empty() || !socket_.empty())
        throw host::UsageError(fmt::format("obscura {}: --url excludes --control and --socket", verb));
    HttpOptions options = url_.http(verb);
    options.camera = camera_;
    options.timeout_s = timeout_s;
    return connect_by_http(verb, options);
}

std::string refusal_line(std::string_view verb, std::string_view call, std::string message,
                         std::string_view hint) {
    if (const std::string prefix = fmt::format("{}: ", call); message.rfind(prefix, 0) == 0)
        message.erase(0, prefix.size());
    constexpr std::array<std::pair<std::string_view, std::string_view>, 3> verbs{
        {{"camera.start", "obscura start"},
         {"camera.stop", "obscura stop"},
         {"camera.set", "obscura set TriggerMode=On TriggerSource=Software"}}};
    std::string line = fmt::format("obscura {}: {}", verb, message);
    for (const auto& [name, words] : verbs)
        if (hint == name) return line + fmt::format(" (try: {})", words);
    if (!hint.empty()) line += fmt::format(" ({})", hint);
    return line;
}

} // namespace obscura::tools
