// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/configuration_call.hpp"

#include "emulator/config/configuration_entries.hpp"

#include <fmt/format.h>

#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace obscura::emulator {

using nlohmann::json;
using service::Failure;
using service::FailureCode;

namespace {

struct Values {
    json values = json::object();

    service::Fields fields() {
        service::Fields all;
        all.free.push_back({"values", "map", "Tables as those of the file: {\"trigger\": {\"rate_hz\": 20}}",
                            &values, true});
        return all;
    }
};

/// The key that a line "configuration.set: trigger.rate_hz: why" is about; empty: it is no such line.
std::string key_of(std::string_view line) {
    const std::string begin = fmt::format("{}: ", set_configuration_name);
    if (!line.starts_with(begin)) return {};
    line.remove_prefix(begin.size());
    return std::string(line.substr(0, line.find(": ")));
}

/// Keys whose values differ, with those that they have now.
json changed_values(const json& before, const json& now) {
    std::map<std::string, json> old;
    for (const json& entry : before.at("entries"))
        old[entry.at("key")] = entry.at("value");
    json changed = json::object();
    for (const json& entry : now.at("entries"))
        if (const std::string key = entry.at("key"); old[key] != entry.at("value"))
            changed[key] = entry.at("value");
    return changed;
}

} // namespace

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

service::Calls configuration_calls(SceneRequests& requests,
                                   std::function<std::shared_ptr<const json>()> answer) {
    service::Call list = service::call<service::NoArguments>(
        "configuration", service::Permission::view,
        "Lists every key of the configuration in use, as `obscurad --print-config` prints them.",
        [answer](const service::NoArguments&, service::Work& /*work*/) {
            return service::Answer{*answer()};
        });
    list.results = {{"entries", "array of maps", "",
                     "key: its dotted path, lists numbered (gige.faults[0].kind); "
                     "value and default: as TOML, \"\" for no default; unit; source: "
                     "FILE:LINE, default, scene.show for the scene that it shows, or configuration.set"},
                    {"file", "string", "", "The configuration file"},
                    {"sha256", "string", "",
                     "SHA-256 of the sorted lines KEY = VALUE: equal for configurations that do the same"}};
    service::Call set = service::call<Values>(
        set_configuration_name, service::Permission::admin,
        "Changes values of the configuration in use from the next frame on, all that are given or none: those that a reload can change, except scene.file. "
        "The file stays as it is, and the next reload returns to it.",
        [&requests, answer = std::move(answer)](const Values& wanted, service::Work& work) {
            if (!wanted.values.is_object() || wanted.values.empty())
                throw service::bad_argument("values",
                                            fmt::format("{}: values: tables as those of the file are wanted",
                                                        set_configuration_name));
            const auto before = answer();
            const std::string why =
                requests.ask(service::value_of(wanted.values, "values"), work.cancelled());
            if (const std::string key = key_of(why); !key.empty()) throw service::bad_argument(key, why);
            if (!why.empty()) throw Failure(FailureCode::not_now, why);
            return service::Answer{{{"changed", changed_values(*before, *answer())}}};
        });
    set.results = {{"changed", "map", "",
                    "Keys whose values have changed, by their dotted paths, and the values as TOML"}};
    return {std::move(list), std::move(set)};
}

} // namespace obscura::emulator
