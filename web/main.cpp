// SPDX-License-Identifier: Apache-2.0
// Main program obscura-web: page, metrics and events of the daemons of this machine over HTTP.
#include "core/error.hpp"
#include "core/realtime/log.hpp"
#include "core/text/printable.hpp"
#include "host/command_line.hpp"
#include "host/interrupt.hpp"
#include "host/monitor_paths.hpp"
#include "host/service_notify.hpp"
#include "host/standard_output.hpp"
#include "host/web_links.hpp"
#include "web/api/openapi.hpp"
#include "web/api/routes.hpp"
#include "web/http_server.hpp"
#include "web/live/daemon_watch.hpp"
#include "web/live/live_pictures.hpp"
#include "web/server/link_file.hpp"
#include "web/server/stream.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#ifndef OBSCURA_VERSION
#error "OBSCURA_VERSION comes from the build"
#endif

namespace {

using namespace obscura;
using namespace obscura::web;

struct Options {
    std::string tokens, new_token, name, role = "viewer", socket, certificate, key;
    std::vector<std::string> addresses, hosts;
    bool insecure = false, interface = false, version = false;
};

host::CommandLine declare(Options& options) {
    host::CommandLine line;
    line.program = "";
    line.summary = "serves page, metrics and events of the cameras of this machine over HTTP";
    line.description =
        "Asks every daemon of this machine that this user may ask twice a second through its monitor socket and shows a page, metrics for Prometheus and the log. "
        "Through the calls of a daemon with [control] it changes settings, faults and scenes, for those whose token has the role operator or admin. "
        "It listens at the loopback interface; who asks needs a token, which is part of the link that is printed. "
        "With --tokens FILE the tokens are those of the file, of which it holds the hashes only; "
        "otherwise one is made for this run.";
    line.option(
        "--listen", &options.addresses, "ADDRESS:PORT",
        "Listen here; port 0: any free one; may be given several times; default 127.0.0.1:8420 and [::1]:8420");
    line.option(
        "--host", &options.hosts, "NAME",
        "Further name by which browsers may call this server, as NAME or NAME:PORT, or https://NAME behind a proxy; "
        "may be given several times");
    line.option("--tokens", &options.tokens, "FILE", "File of tokens, a line each: ROLE SHA256 [NAME]");
    line.option("--new-token", &options.new_token, "ROLE",
                "Make a token, add it to the file of --tokens, print its link and end")
        .choices = {"viewer", "operator", "admin"};
    line.option(
        "--name", &options.name, "NAME",
        "Name of the new token's holder, for the record of changes: letters, digits, \".\", \"_\", \"-\"");
    line.option("--role", &options.role, "ROLE", "Role of the token that is made for this run").choices = {
        "viewer", "operator", "admin"};
    line.option("--socket", &options.socket, "PATH",
                "Ask the daemon with this socket (its monitor.socket) only");
    line.option("--tls-certificate", &options.certificate, "FILE",
                "Speak HTTPS with this certificate, and those above it, in PEM");
    line.option("--tls-key", &options.key, "FILE", "Private key of the certificate, in PEM");
    line.flag(
        "--insecure", options.insecure,
        "Allow an address that is not of the loopback interface: tokens and pictures cross the network unencrypted");
    line.flag("--print-interface", options.interface, "Print the interface as OpenAPI 3.1 and end");
    line.flag("--version", options.version, "Print the version and end");
    line.examples = {"obscura-web", "obscura-web --tokens tokens --new-token operator --name alice",
                     "curl -H \"Authorization: Bearer $TOKEN\" http://127.0.0.1:8420/metrics"};
    return line;
}

/// Where it listens; by default also at ::1, if this machine has it.
std::vector<std::string> addresses_of(const Options& options) {
    if (!options.addresses.empty()) return options.addresses;
    std::vector<std::string> addresses{"127.0.0.1:8420"};
    if (const char* const other = "[::1]:8420"; is_here(other)) addresses.emplace_back(other);
    return addresses;
}

/// The page's address by the name of the first --host, or that of the first address. `port`: of the listener.
std::string page_of(const Options& options, const std::string& address, std::string_view port) {
    const char* const scheme = options.certificate.empty() ? "http" : "https";
    const std::string name = is_wildcard(address) ? "localhost" : host_of(address);
    if (is_loopback(address) || options.hosts.empty()) return fmt::format("{}://{}:{}/", scheme, name, port);
    const std::string& host = options.hosts.front();
    if (host.find("://") != std::string::npos) return host + "/";
    return OwnNames::has_port(host) ? fmt::format("{}://{}/", scheme, host)
                                    : fmt::format("{}://{}:{}/", scheme, host, port);
}

/// What stands after "#" stays in the browser.
std::string link(const std::string& page, const std::string& token) {
    return token.empty() ? page : fmt::format("{}#token={}", page, token);
}

int make_token(const Options& options) {
    if (options.tokens.empty()) throw host::UsageError("obscura-web: --new-token: --tokens FILE is wanted");
    if (!options.name.empty() && !Tokens::is_name(options.name))
        throw host::UsageError(
            "obscura-web: --name: allowed are 1 to 32 letters, digits, \".\", \"_\" and \"-\"");
    const std::string token = Tokens::make();
    const mode_t before = ::umask(027);
    std::ofstream out(options.tokens, std::ios::app);
    ::umask(before);
    out << Tokens::line(*enum_named<Role>(options.new_token), token, options.name) << '\n';
    out.close();
    if (!out) throw OutputError(fmt::format("{}: {}", options.tokens, std::strerror(errno)), errno);
    const std::string address = addresses_of(options).front();
    fmt::print(
        "{}\n",
        link(page_of(options, address, std::string_view(address).substr(address.rfind(':') + 1)), token));
    return exit_ok;
}

/// Says once that the page is served where a camera sends its frames.
class SharedInterface {
public:
    explicit SharedInterface(std::vector<std::string> addresses) : addresses_(std::move(addresses)) {}

    void look(const Sighting& sighting) {
        for (const auto& state : sighting.states)
            for (const auto& camera : state.at("cameras")) {
                const auto address = camera.find("address");
                if (said_ || address == camera.end() || !address->is_string()) continue;
                if (const auto& text = address->get_ref<const std::string&>(); is_shared(text)) {
                    said_ = true;
                    log_warning(
                        "web: the page is served at the interface of camera {}: viewers and its stream share the line; "
                        "give --listen another address",
                        text);
                }
            }
    }

private:
    [[nodiscard]] bool is_shared(const std::string& camera) const {
        try {
            if (is_loopback(camera)) return false;
            return std::any_of(addresses_.begin(), addresses_.end(), [&](const std::string& own) {
                return is_wildcard(own) || host_of(own) == host_of(camera);
            });
        } catch (const InputError&) { // no GigE Vision, or a daemon of another version
            return false;
        }
    }

    const std::vector<std::string> addresses_;
    bool said_ = false;
};

/// Names by which it may be called at all of its addresses.
std::vector<std::string> names_of(const Options& options, const std::vector<std::string>& addresses,
                                  const std::vector<std::uint16_t>& ports) {
    std::vector<std::string> names = options.hosts;
    for (std::size_t i = 0; i < addresses.size(); ++i) {
        std::vector<std::string> here{"localhost", "127.0.0.1", "[::1]"};
        // No page of another site can have a number as its name.
        if (!is_wildcard(addresses[i])) here.push_back(host_of(addresses[i]));
        for (const std::string& host : options.hosts)
            if (!OwnNames::has_port(host) && host.find("://") == std::string::npos) here.push_back(host);
        for (const std::string& name : here)
            names.push_back(fmt::format("{}:{}", name, ports[i]));
    }
    return names;
}

int serve(const Options& options) {
    if (options.certificate.empty() != options.key.empty())
        throw host::UsageError("obscura-web: --tls-certificate and --tls-key are wanted together");
    const bool secure = !options.certificate.empty();
    const std::vector<std::string> addresses = addresses_of(options);
    for (const std::string& host : options.hosts)
        if (!OwnNames::is_name(host))
            throw host::UsageError(fmt::format(
                "obscura-web: --host {}: allowed are NAME, NAME:PORT, and either after https:// or http://",
                host));
    for (const std::string& address : addresses) {
        if (!is_loopback(address) && !secure && !options.insecure)
            throw ConfigError(fmt::format(
                "obscura-web: --listen {}: not of the loopback interface: tokens would cross the network unencrypted. "
                "Use --tls-certificate, a tunnel (ssh -L 8420:127.0.0.1:8420 HOST), or --insecure",
                address));
    }
    Tokens tokens;
    std::string token;
    if (options.tokens.empty()) {
        token = Tokens::make();
        tokens.add(*enum_named<Role>(options.role), token);
    } else {
        tokens = Tokens::read(options.tokens);
    }
    std::optional<Tls> tls;
    if (secure) tls.emplace(options.certificate, options.key);
    HttpServer server(HttpLimits{}, addresses, tls ? &*tls : nullptr);
    const auto figures = std::make_shared<WebFigures>();
    const auto frames = std::make_shared<KeptFrames>();
    const auto pictures = std::make_shared<LivePictures>(live_bytes_per_s, figures, frames);
    DaemonWatch watch(options.socket, std::chrono::milliseconds(500), pictures.get());
    pictures->when_wanted([&watch] { watch.look_soon(); });
    server.serve_live(pictures);
    Routes routes({tokens, OwnNames(names_of(options, addresses, server.ports()), server.port(), secure),
                   OBSCURA_VERSION, figures, frames},
                  watch);
    const std::string page =
        link(page_of(options, addresses.front(), fmt::format("{}", server.port())), token);
    host::remove_left_over_web_links();
    const LinkFile file(host::own_monitor_folder(), page);
    fmt::print("{}\n", page);
    std::fflush(stdout);
    host::notify_service_manager("READY=1");
    SharedInterface shared(addresses);
    server.run(routes, watch, [&] {
        shared.look(*watch.latest());
        return host::interrupted();
    });
    host::notify_service_manager("STOPPING=1");
    return exit_ok;
}

int run(const std::vector<std::string>& arguments) {
    Options options;
    if (!declare(options).parse("obscura-web", arguments)) return exit_ok;
    if (options.version) {
        fmt::print("obscura-web {}\n", OBSCURA_VERSION);
        return exit_ok;
    }
    if (options.interface) {
        fmt::print("{}\n", openapi_document(OBSCURA_VERSION).dump(2));
        return exit_ok;
    }
    if (!options.new_token.empty()) return make_token(options);
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
        print_message(fmt::format("obscura-web: internal error: {}", error.what()));
        return exit_software;
    }
}
