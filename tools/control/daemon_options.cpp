// SPDX-License-Identifier: Apache-2.0
#include "tools/control/daemon_options.hpp"

#include "tools/control/http_calls.hpp"
#include "tools/control/native_calls.hpp"
#include "tools/support/monitor_client.hpp"

#include <fmt/format.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <utility>

namespace obscura::tools {

void DaemonOptions::declare(CommandLine& line, Has has) {
    if (has == Has::camera)
        line.number("--camera", &camera_, "N", "Number of the camera, where the daemon has several", 0, 1000);
    line.option("--socket", &socket_, "PATH",
                "Call the daemon with this monitor.socket; needed where several daemons run on this machine");
    line.option("--control", &control_, "ADDRESS",
                "Call the daemon at its control.unix_socket or control.listen, a path or HOST:PORT, without "
                "looking for it");
    line.option(
        "--url", &url_, "URL",
        "Call the daemon behind an obscura-web on another machine, https://HOST:8420, or a link as obscura "
        "web prints it; else its token comes from --token-file or the environment variable OBSCURA_TOKEN");
    line.option("--token-file", &token_file_, "FILE",
                "File of the token that a daemon with control.token_file wants; with --url: file whose first "
                "line is the token of obscura-web");
    line.option("--cacert", &authority_, "FILE",
                "With --url: certificates that are trusted, instead of those of the system");
}

std::string DaemonOptions::control_address(std::string_view verb) const {
    if (!control_.empty()) return control_;
    const CallJson state =
        connect_to_daemon(fmt::format("obscura {}", verb), socket_).ask({{"verb", "state"}});
    const CallJson daemon = state.value("daemon", CallJson::object());
    const std::string address = daemon.value("control", std::string());
    if (address.empty())
        throw HardwareError(
            fmt::format("obscura {}: the daemon takes no calls: set control.unix_socket in {}", verb,
                        daemon.value("config", std::string("its configuration"))));
    return address;
}

std::unique_ptr<DaemonCalls> DaemonOptions::connect_over_web(std::string_view verb, double patience_s) const {
    HttpOptions options{
        .url = url_, .token = {}, .authority = authority_, .camera = camera_, .patience_s = patience_s};
    if (!control_.empty() || !socket_.empty())
        throw UsageError(fmt::format("obscura {}: --url excludes --control and --socket", verb));
    // A link as `obscura web` prints it has the token behind it.
    constexpr std::string_view mark = "/#token=";
    if (const std::size_t at = url_.find(mark); at != std::string::npos) {
        options.token = url_.substr(at + mark.size());
        options.url.erase(at);
    } else if (token_file_.empty()) {
        const char* const token = std::getenv("OBSCURA_TOKEN");
        options.token = token == nullptr ? "" : token;
    } else {
        std::ifstream in(token_file_);
        if (!std::getline(in, options.token))
            throw InputError(fmt::format("obscura {}: --token-file {}: cannot be read", verb, token_file_));
    }
    return connect_by_http(verb, std::move(options));
}

std::unique_ptr<DaemonCalls> DaemonOptions::connect(std::string_view verb, double patience_s) const {
    if (!url_.empty()) return connect_over_web(verb, patience_s);
    return connect_natively(verb, control_address(verb), {patience_s, token_file_});
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
