// SPDX-License-Identifier: Apache-2.0
#include "serve/compatible/door_host.hpp"

#include "core/error.hpp"
#include "serve/compatible/handlers.hpp"
#include "service/compatible/connection.hpp"

#include <fmt/format.h>

namespace obscura::serve::compatible {
namespace {

class DoorSession final : public service::compatible::Session {
public:
    DoorSession(const DoorSettings& settings, service::MemoryAccount& memory) : door_(settings, memory) {}

    void run(const service::compatible::Command& command, const Arguments& arguments, service::Work& work,
             Reply& reply) override {
        const auto handler = handlers().find(command.name);
        if (handler == handlers().end())
            throw Failure(FailureCode::unknown_call,
                          fmt::format("{}: not supported by this server", command.name));
        Request request{command, door_, arguments, reply, work};
        try {
            handler->second(request);
        } catch (const Failure& failure) {
            // Whatever a call is made of, its line begins with its name.
            const std::string_view what = failure.what();
            if (what.starts_with(command.name)) throw;
            throw Failure(failure.code, fmt::format("{}: {}", command.name, what));
        } catch (const Error& error) { // of files
            throw Failure(FailureCode::bad_argument,
                          fmt::format("{}: {}", command.name, door_.files.without_folders(error.what())));
        }
    }

private:
    Door door_;
};

} // namespace

std::unique_ptr<service::compatible::Session> DoorHost::open(service::MemoryAccount& memory) {
    return std::make_unique<DoorSession>(settings_, memory);
}

service::Door make_door(service::Listener listener, service::compatible::Host& host,
                        const service::compatible::DoorLimits& limits, service::MemoryAccount& memory,
                        std::size_t clients) {
    return {std::move(listener),
            [&host, &memory, limits](FileDescriptor socket, std::function<void()> wake) {
                return std::make_unique<service::compatible::Connection>(std::move(socket), limits, host,
                                                                         memory, std::move(wake));
            },
            service::compatible::line_packet(
                fmt::format("[error] {} clients are connected already, allowed {}", clients, clients))
                .start};
}

} // namespace obscura::serve::compatible
