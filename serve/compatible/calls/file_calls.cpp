// SPDX-License-Identifier: Apache-2.0
// Commands of files: folders, and what the client sends.
#include "serve/compatible/client_files.hpp"
#include "serve/compatible/client_state.hpp"
#include "serve/compatible/handlers.hpp"
#include "serve/compatible/packed_bytes.hpp"
#include "service/failure.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>

namespace obscura::serve::compatible {
namespace {

using service::compatible::Fields;

/// Largest part of a file: the client sends 1 MiB at a time.
constexpr std::size_t max_bytes = std::size_t{64} << 20;

void send_file(ClientState& client_state, const Arguments& arguments) {
    const std::string& sent = arguments.bytes("data");
    const auto offset = static_cast<std::uint64_t>(
        arguments.integer("offset", 0, std::numeric_limits<std::int32_t>::max() * std::int64_t{1} << 20));
    client_state.files.receive(arguments.text("filename"),
                               arguments.flag("compressed") ? inflate_packed(sent, max_bytes) : sent, offset,
                               arguments.flag("append"));
}

/// Asks for the files whose content is not here: under the names that the client has offered, which it opens
/// in the folder that it has named.
void synchronise(ClientState& client_state, const Arguments& arguments, Reply& reply) {
    const List& files = *arguments.value("files").as<List>();
    const List* targets = arguments.has("targets") ? arguments.value("targets").as<List>() : nullptr;
    if (targets != nullptr && targets->size() != files.size()) {
        reply.warn(
            fmt::format("syncDir: targets: {} names for {} files, not used", targets->size(), files.size()));
        targets = nullptr;
    }
    const std::string& folder = arguments.text("dirname");
    client_state.files.synchronise(folder);
    List wanted;
    for (std::size_t i = 0; i < files.size(); ++i) {
        const List* const row = files[i].as<List>();
        const auto text = [&](std::size_t at) {
            const std::string* const found =
                row != nullptr && row->size() == 2 ? (*row)[at].as<std::string>() : nullptr;
            if (found == nullptr)
                throw arguments.refused("files", fmt::format("row {} is none", i),
                                        "rows of a name and its MD5");
            return *found;
        };
        const std::string name = text(0);
        const std::string* const target = targets != nullptr ? (*targets)[i].as<std::string>() : nullptr;
        if (client_state.files.has(target != nullptr ? *target : name, text(1))) continue;
        Fields ask{
            {"requested_file", name},
            {"dirname", name.starts_with('/') ? std::string() : folder},
            {"compressionLevel", static_cast<std::int32_t>(arguments.integer("compressionLevel", -1, 9))}};
        if (target != nullptr) ask.push_back({"target", *target});
        wanted.emplace_back(std::move(ask));
    }
    reply.set("files2update", std::move(wanted));
}

} // namespace

void add_file_calls(Handlers& handlers) {
    handlers["cd"] = [](Request& r) { r.client_state.files.change_folder(r.arguments.text("path")); };
    handlers["pwd"] = [](Request& r) { r.reply.set("path", r.client_state.files.folder()); };
    handlers["ls"] = [](Request& r) { r.reply.set("listing", r.client_state.files.listing()); };
    handlers["setRessourcePath"] = [](Request& r) {
        r.client_state.files.set_resource_path(r.arguments.text("ressource_path"));
    };
    handlers["getRessourcePath"] = [](Request& r) {
        r.reply.set("ressource_path", r.client_state.files.resource_path());
    };
    handlers["sendFile"] = [](Request& r) { send_file(r.client_state, r.arguments); };
    handlers["syncDir"] = [](Request& r) { synchronise(r.client_state, r.arguments, r.reply); };
}

} // namespace obscura::serve::compatible
