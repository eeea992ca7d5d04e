// SPDX-License-Identifier: Apache-2.0
// Commands about the connection itself.
#include "serve/compatible/handlers.hpp"

#include <fmt/format.h>

namespace obscura::serve::compatible {
namespace {

using service::compatible::Command;
using service::compatible::commands;

std::string help_of(const std::string& name) {
    const Command* const command = service::compatible::find_command(name);
    if (command == nullptr) return fmt::format("There is no call '{}'.", name);
    return fmt::format("{}\n{}{}", signature(*command), command->help,
                       handlers().contains(name) ? "" : " Not supported by this server.");
}

} // namespace

void add_connection_calls(Handlers& handlers) {
    handlers["close"] = handlers["closeViewer"] = [](Request&) {};
    handlers["version"] = [](Request& r) { r.reply.set("version", "Obscura " + r.client_state.version()); };
    handlers["help"] = [](Request& r) { r.reply.set("help", help_of(r.arguments.text("function_name"))); };
    handlers["printAPI"] = [](Request& r) {
        std::string text;
        for (const Command& command : commands())
            text += signature(command) + '\n';
        r.reply.set("api", std::move(text));
    };
    handlers["setCompressionLevel"] = [](Request& r) {
        r.client_state.rendering.compression =
            static_cast<std::int32_t>(r.arguments.integer("compression_level", 0, 9));
    };
    handlers["setMetadata"] = [](Request& r) {
        r.client_state.metadata.set(r.arguments.text("name"), r.arguments.value("value"));
    };
    handlers["getMetadata"] = [](Request& r) { r.reply.set("metadata", r.client_state.metadata.all()); };
    handlers["clearMetadata"] = [](Request& r) { r.client_state.metadata.clear(); };
}

} // namespace obscura::serve::compatible
