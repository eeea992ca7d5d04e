// SPDX-License-Identifier: Apache-2.0
#include "serve/compatible/compatible_host.hpp"

#include "core/error.hpp"
#include "serve/compatible/handlers.hpp"
#include "service/compatible/connection.hpp"

#include <fmt/format.h>

namespace obscura::serve::compatible {
namespace {

class HostedSession final : public service::compatible::Session {
public:
    HostedSession(const CompatibleSettings& settings, service::MemoryAccount& memory)
        : client_state_(settings, memory) {}

    void run(const service::compatible::Command& command, const Arguments& arguments, service::Work& work,
             Reply& reply) override {
        const auto handler = handlers().find(command.name);
        if (handler == handlers().end())
            throw Failure(FailureCode::unknown_call,
                          fmt::format("{}: not supported by this server", command.name));
        Request request{command, client_state_, arguments, reply, work};
        try {
            handler->second(request);
        } catch (const Failure& failure) {
            // Whatever a call is made of, its line begins with its name.
            const std::string_view what = failure.what();
            if (what.starts_with(command.name)) throw;
            throw Failure(failure.code, fmt::format("{}: {}", command.name, what));
        } catch (const Error& error) { // of files
            throw Failure(
                FailureCode::bad_argument,
                fmt::format("{}: {}", command.name, client_state_.files.without_folders(error.what())));
        }
    }

private:
    ClientState client_state_;
};

} // namespace

std::unique_ptr<service::compatible::Session> CompatibleHost::open(service::MemoryAccount& memory) {
    return std::make_unique<HostedSession>(settings_, memory);
}

service::ListeningEndpoint make_compatible_endpoint(service::Listener listener,
                                                    service::compatible::Host& host,
                                                    const service::compatible::CompatibleLimits& limits,
                                                    service::MemoryAccount& memory, std::size_t clients) {
    return {
        std::move(listener),
        [&host, &memory, limits](FileDescriptor socket, std::function<void()> wake) {
            return std::make_unique<service::compatible::Connection>(std::move(socket), limits, host, memory,
                                                                     std::move(wake));
        },
        {.refusal = service::compatible::line_packet(
                        fmt::format("[error] {} clients are connected already, allowed {}", clients, clients))
                        .start}};
}

} // namespace obscura::serve::compatible
