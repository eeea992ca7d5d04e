// SPDX-License-Identifier: Apache-2.0
// Main program obscura-web: page, metrics and events of the daemons of this machine over HTTP.
#include "core/error.hpp"
#include "core/terminal_text.hpp"
#include "emulator/monitor/monitor_paths.hpp"
#include "emulator/service_notify.hpp"
#include "tools/support/command_line.hpp"
#include "tools/support/interrupt.hpp"
#include "tools/support/web_links.hpp"
#include "web/daemon_watch.hpp"
#include "web/http_server.hpp"
#include "web/link_file.hpp"
#include "web/live_pictures.hpp"
#include "web/openapi.hpp"
#include "web/routes.hpp"
#include "web/stream.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#ifndef OBSCURA_VERSION
#error "OBSCURA_VERSION comes from the build"
#endif

namespace {

using namespace obscura;
using namespace obscura::web;

struct Options {
    std::string address = "127.0.0.1:8420", tokens, new_token, name, role = "viewer", socket, certificate,
                key;
    std::vector<std::string> hosts;
    bool insecure = false, interface = false, version = false;
};

tools::CommandLine declare(Options& options) {
    tools::CommandLine line;
    line.program = "";
    line.summary = "serves page, metrics and events of the cameras of this machine over HTTP";
    line.description = "Asks every daemon of this machine that this user may ask twice a second through its "
                       "monitor socket and shows a page, metrics for Prometheus and the log. Through the "
                       "calls of a daemon with [control] it changes settings, faults and scenes, for those "
                       "whose token has the role operator or admin. It listens at the loopback interface; "
                       "who asks needs a token, which is part of the link that is printed. With --tokens "
                       "FILE the tokens are those of the file, of which it holds the hashes only; otherwise "
                       "one is made for this run.";
    line.option("--listen", &options.address, "ADDRESS:PORT", "Listen here; port 0: any free one");
    line.option("--host", &options.hosts, "NAME",
                "Further name by which browsers may call this server; may be given several times");
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
    line.flag("--insecure", options.insecure,
              "Allow an address that is not of the loopback interface: tokens and pictures cross the network "
              "unencrypted");
    line.flag("--print-interface", options.interface, "Print the interface as OpenAPI 3.1 and end");
    line.flag("--version", options.version, "Print the version and end");
    line.examples = {"obscura-web", "obscura-web --tokens tokens --new-token operator --name alice",
                     "curl -H \"Authorization: Bearer $TOKEN\" http://127.0.0.1:8420/metrics"};
    return line;
}

std::string link(const Options& options, const std::string& host, const std::string& token) {
    const std::string page = fmt::format("{}://{}/", options.certificate.empty() ? "http" : "https", host);
    // What stands after "#" stays in the browser.
    return token.empty() ? page : fmt::format("{}#token={}", page, token);
}

int make_token(const Options& options) {
    if (options.tokens.empty()) throw tools::UsageError("obscura-web: --new-token: --tokens FILE is wanted");
    if (!options.name.empty() && !Tokens::is_name(options.name))
        throw tools::UsageError(
            "obscura-web: --name: allowed are 1 to 32 letters, digits, \".\", \"_\" and \"-\"");
    const std::string token = Tokens::make();
    const mode_t before = ::umask(027);
    std::ofstream out(options.tokens, std::ios::app);
    ::umask(before);
    out << Tokens::line(*enum_named<Role>(options.new_token), token, options.name) << '\n';
    out.close();
    if (!out) throw OutputError(fmt::format("{}: {}", options.tokens, std::strerror(errno)));
    fmt::print("{}\n", link(options, options.address, token));
    return exit_ok;
}

int serve(const Options& options) {
    if (options.certificate.empty() != options.key.empty())
        throw tools::UsageError("obscura-web: --tls-certificate and --tls-key are wanted together");
    const bool secure = !options.certificate.empty();
    if (!is_loopback(options.address) && !secure && !options.insecure)
        throw ConfigError(
            fmt::format("obscura-web: --listen {}: not of the loopback interface: tokens would cross "
                        "the network unencrypted. Use --tls-certificate, a tunnel (ssh -L "
                        "8420:127.0.0.1:8420 HOST), or --insecure",
                        options.address));
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
    HttpServer server(HttpLimits{}, {options.address}, tls ? &*tls : nullptr);
    const std::string host =
        fmt::format("{}:{}", options.address.substr(0, options.address.rfind(':')), server.port());
    const auto figures = std::make_shared<WebFigures>();
    const auto frames = std::make_shared<KeptFrames>();
    const auto pictures = std::make_shared<LivePictures>(live_bytes_per_s, figures, frames);
    DaemonWatch watch(options.socket, std::chrono::milliseconds(500), pictures.get());
    pictures->when_wanted([&watch] { watch.look_soon(); });
    server.serve_live(pictures);
    Routes routes({tokens, OwnNames(options.hosts, server.port(), secure), OBSCURA_VERSION, figures, frames},
                  watch);
    const std::string page = link(options, host, token);
    tools::remove_left_over_web_links();
    const LinkFile file(emulator::own_monitor_folder(), page);
    fmt::print("{}\n", page);
    std::fflush(stdout);
    emulator::notify_service_manager("READY=1");
    server.run(routes, watch, [] { return tools::interrupted(); });
    emulator::notify_service_manager("STOPPING=1");
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
        fmt::print(stderr, "obscura-web: internal error: {}\n", for_terminal(error.what()));
        return exit_software;
    }
}
