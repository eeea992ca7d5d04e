// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/configuration_call.hpp"

#include "emulator/config/configuration_entries.hpp"

#include <utility>
#include <vector>

namespace obscura::emulator {

using nlohmann::json;

json describe_configuration(const DaemonConfig& config) {
    const std::vector<config::Entry> entries = configuration_entries(config);
    json rows = json::array();
    for (const config::Entry& entry : entries)
        rows.push_back({{"key", entry.key},
                        {"value", entry.value},
                        {"unit", entry.unit},
                        {"default", entry.by_default},
                        {"source", entry.source}});
    return {{"entries", std::move(rows)},
            {"file", config.source.string()},
            {"sha256", configuration_sha256(entries)}};
}

service::Call configuration_call(std::function<std::shared_ptr<const json>()> answer) {
    service::Call call = service::call<service::NoArguments>(
        "configuration", service::Permission::view,
        "Lists every key of the configuration in use, as `obscurad --print-config` prints them.",
        [answer = std::move(answer)](const service::NoArguments&, service::Work& /*work*/) {
            return service::Answer{*answer()};
        });
    call.results = {{"entries", "array of maps", "",
                     "key: its dotted path, lists numbered (gige.faults[0].kind); value and default: as "
                     "TOML, \"\" for no "
                     "default; unit; source: FILE:LINE, default, or scene.show for the scene that it shows"},
                    {"file", "string", "", "The configuration file"},
                    {"sha256", "string", "",
                     "Of the sorted lines KEY = VALUE: equal for configurations that do the same"}};
    return call;
}

} // namespace obscura::emulator
