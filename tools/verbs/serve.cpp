// SPDX-License-Identifier: Apache-2.0
// Verb `obscura serve`: renders scenes for clients.
#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "host/interrupt.hpp"
#include "host/service_notify.hpp"
#include "serve/compatible/compatible_host.hpp"
#include "serve/render_host.hpp"
#include "service/listener.hpp"
#include "service/server.hpp"
#include "service/tokens.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

namespace obscura::tools {
namespace {

/// Whether standard input has ended; what is in it is thrown away.
bool input_ended() {
    pollfd input{STDIN_FILENO, POLLIN, 0};
    if (::poll(&input, 1, 0) <= 0) return false;
    char text[256];
    return ::read(STDIN_FILENO, text, sizeof text) <= 0;
}

class Serve final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "renders scenes for programs that connect to it";
        line.description =
            "A server for programs: each client has a scene of its own, which it loads, or builds key by key with the keys of scene files, and gets its pictures as arrays of W/m2 per pixel, or of the digital numbers of a sensor, with depth, normals and poses if it wants them. "
            "The same scene and settings give the same bytes as obscura render. "
            "The Python client obscura_client starts such a server by itself, or connects to one; "
            "docs/clients.md describes it, the calls and the protocol. "
            "Only this machine can connect over TCP (a tunnel of ssh serves others), unless --token-file names what clients must have. "
            "The files that they may name are those below --root and the shipped ones. "
            "Each address is printed once the server listens there. It ends on SIGTERM or SIGINT.";
        line.option(
            "--listen", &address_, "ADDRESS:PORT",
            "Listen at this address, without tokens one of the loopback interface; port 0: any free one; "
            "\"none\": not over TCP");
        line.option("--unix", &socket_, "PATH",
                    "Listen at this Unix socket too, which the user and group of the server may use");
        line.option(
            "--compatible", &compatible_, "ADDRESS:PORT",
            "Serve the published client (version 8) of another program too, at this address of the loopback interface, such as 127.0.0.1:5151 (docs/published-client.md); "
            "\"none\": not");
        line.option(
            "--root", &root_, "DIR",
            "Folder that the file names of clients start from and stay below (default: the working directory)");
        line.option(
            "--output", &output_, "DIR",
            "Folder below which clients of --compatible may write pictures and files; without it they can write nothing");
        line.option(
            "--token-file", &token_files_, "[PERMISSION:]FILE",
            "Clients over TCP need this token, which permits view, operate, scene (if none is named) or admin; "
            "may be given several times");
        line.option(
            "--make-token", &new_token_, "FILE",
            "Only write a new token of 32 random bytes, for both sides, to a file that does not exist");
        line.option(
            "--resources", &resources_, "FILE",
            "TOML table of files that stand for names which clients of --compatible ask for (docs/published-client.md)");
        line.number("--threads", &picture_.threads, "N", "Render threads of each client; 0: one per core", 0,
                    1024);
        line.number("--clients", &clients_, "N", "Clients at a time; further ones are refused", 1, 1000);
        line.number(
            "--memory", &memory_mib_, "MIB",
            "Memory in MiB that the pictures of all clients, what they share, and the long messages of --compatible may take",
            1, 1e9);
        line.flag("--with-input", with_input_,
                  "End when standard input ends, as for a program that started it");
        line.examples = {"obscura serve",
                         "obscura serve --listen none --unix /tmp/obscura.socket --root scenes",
                         "obscura serve --make-token lab.token",
                         "obscura serve --listen 0.0.0.0:5152 --token-file lab.token",
                         "obscura serve --compatible 127.0.0.1:5151 --root resources"};
    }

    [[nodiscard]] bool runs_until_told() const override { return true; }

    int run() override {
        if (!new_token_.empty()) {
            service::make_token_file(new_token_);
            return exit_ok;
        }
        service::Tokens tokens = read_tokens();
        std::error_code error;
        const std::filesystem::path root = std::filesystem::canonical(root_.empty() ? "." : root_, error);
        if (error || !is_folder_at(root))
            throw InputError(
                fmt::format("obscura serve: --root {}: {}", root_, error ? error.message() : "no folder"),
                error.value());
        std::filesystem::path output;
        if (!output_.empty()) {
            output = std::filesystem::canonical(output_, error);
            if (error || !is_folder_at(output))
                throw InputError(fmt::format("obscura serve: --output {}: {}", output_,
                                             error ? error.message() : "no folder"),
                                 error.value());
        }
        std::vector<service::Listener> listeners;
        if (address_ != "none") listeners.push_back(service::Listener::tcp(address_, !tokens.empty()));
        if (!socket_.empty()) listeners.push_back(service::Listener::unix_socket(socket_));
        const bool compatible = compatible_ != "none";
        if (listeners.empty() && !compatible)
            throw host::UsageError(
                "obscura serve: --listen none: --unix PATH or --compatible ADDRESS:PORT is wanted then");
        for (const service::Listener& listener : listeners)
            fmt::print("listening at {}\n", listener.address());
        service::Limits limits;
        limits.clients = clients_;
        limits.memory_bytes = memory_mib_ << 20;
        serve::RenderHost host(OBSCURA_VERSION, root, picture_);
        serve::compatible::CompatibleHost door_host(serve::compatible::CompatibleSettings{
            OBSCURA_VERSION, root, output, picture_,
            resources_.empty() ? serve::compatible::ResourceTable()
                               : serve::compatible::ResourceTable(resources_)});
        service::Server server(limits, host, std::move(listeners), std::move(tokens));
        if (compatible) {
            service::Listener listener = service::Listener::tcp(compatible_);
            fmt::print("published client at {}\n", listener.address());
            server.add(serve::compatible::make_compatible_endpoint(std::move(listener), door_host, {},
                                                                   server.memory(), clients_));
        }
        std::fflush(stdout);
        host::notify_service_manager("READY=1");
        server.run([this] { return host::interrupted() || (with_input_ && input_ended()); });
        host::notify_service_manager("STOPPING=1");
        return exit_ok;
    }

private:
    [[nodiscard]] service::Tokens read_tokens() const {
        service::Tokens tokens;
        for (const std::string& text : token_files_) {
            const std::size_t colon = text.find(':');
            const auto named = colon == std::string::npos
                                   ? std::nullopt
                                   : enum_named<service::Permission>(text.substr(0, colon));
            tokens.add(named.value_or(service::Permission::scene),
                       service::read_token_file(named ? text.substr(colon + 1) : text));
        }
        return tokens;
    }

    std::vector<std::string> token_files_;
    std::string new_token_;
    std::string address_ = "127.0.0.1:5152", compatible_ = "none", socket_, root_, output_, resources_;
    serve::PictureLimits picture_;
    std::uint32_t clients_ = 16;
    std::uint64_t memory_mib_ = 4096;
    bool with_input_ = false;
};

} // namespace

std::unique_ptr<Verb> make_serve() {
    return std::make_unique<Serve>();
}

} // namespace obscura::tools
