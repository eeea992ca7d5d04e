// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/fault_calls.hpp"

#include "core/realtime/log.hpp"
#include "emulator/control/camera_features.hpp"
#include "transports/fault_rules.hpp"

#include <fmt/format.h>

#include <string>
#include <utility>
#include <vector>

namespace obscura::emulator {
namespace {

using nlohmann::json;
using service::Answer;
using service::bad_argument;
using service::Failure;
using service::FailureCode;
using service::Fields;
using transports::FaultRules;

/// Each packet is compared with each rule.
constexpr std::size_t max_rules = 64;

struct Choice {
    std::uint32_t camera = 0;

    Fields fields() { return {{camera_key(&camera)}}; }
};

struct NewRules : Choice { // NOLINT(bugprone-exception-escape): json does not throw when moved
    json rules;

    Fields fields() {
        Fields all = Choice::fields();
        all.free.push_back({"rules", "array of maps",
                            "Rules with the keys of [[gige.faults]]; "
                            "`origin` and `struck` of faults.list are ignored; empty: no faults",
                            &rules, true});
        return all;
    }
};

FaultRules& rules_of(const ControlledCamera& camera) {
    if (camera.faults == nullptr)
        throw Failure(FailureCode::not_now, "faults: no transport of this camera injects faults");
    return *camera.faults;
}

json listed(const FaultRules& faults) {
    json rules = json::array();
    for (const FaultRules::Row& row : faults.armed()) {
        json rule = values_of(row.section.keys);
        rule["origin"] = row.origin;
        rule["struck"] = row.struck;
        rules.push_back(std::move(rule));
    }
    return rules;
}

Answer list_faults(const FaultRules& faults) {
    json kinds = json::array();
    for (const FaultRules::Kind& kind : faults.kinds())
        kinds.push_back({{"name", kind.name}, {"help", kind.help}});
    return {{{"kinds", std::move(kinds)},
             {"parameters", service::describe(faults.blank().section.keys)},
             {"rules", listed(faults)},
             {"frame", faults.newest_frame()}}};
}

std::vector<FaultRules::Row> read(const FaultRules& faults, const json& rules) {
    if (!rules.is_array()) throw bad_argument("rules", "faults.set: rules: allowed an array of maps");
    if (rules.size() > max_rules) {
        const std::string allowed = fmt::format("at most {}", max_rules);
        throw bad_argument("rules",
                           fmt::format("faults.set: rules: {} of them, allowed {}", rules.size(), allowed),
                           allowed);
    }
    std::vector<FaultRules::Row> rows;
    for (const json& given : rules) {
        json keys = given;
        if (keys.is_object()) keys.erase("origin"), keys.erase("struck");
        rows.push_back(faults.blank());
        service::read_section("faults.set", fmt::format("rules[{}]", rows.size() - 1), keys,
                              rows.back().section);
    }
    return rows;
}

} // namespace

service::Calls fault_calls(const CameraCalls::Cameras& cameras) {
    using service::call;
    using service::Permission;
    service::Calls calls{
        call<Choice>("faults.list", Permission::view,
                     "Lists the injected faults of a camera that are in force, and what they have struck.",
                     [&cameras](const Choice& choice, service::Work& /*work*/) {
                         return list_faults(rules_of(checked_camera(cameras, choice.camera)));
                     }),
        call<NewRules>(
            "faults.set", Permission::operate,
            "Replaces all injected faults of a camera from its next frame on, also while a client controls it. "
            "All of them or, if one is wrong, none; a rule that is in force already stays, with what it has struck.",
            [&cameras](const NewRules& wanted, service::Work& /*work*/) {
                ControlledCamera& camera = checked_camera(cameras, wanted.camera);
                FaultRules& faults = rules_of(camera);
                const std::vector<FaultRules::Row> rows = read(faults, wanted.rules);
                json now;
                camera.run([&](const std::string& /*controller*/) {
                    faults.arm(rows);
                    now = listed(faults);
                });
                log_notice("calls: camera {}: {} rules of injected faults", wanted.camera, rows.size());
                return Answer{{{"rules", std::move(now)}}};
            })};
    calls[0].results = {
        {"kinds", "array of maps", "", "Kinds of faults: name, help"},
        {"parameters", "array of maps", "",
         "Keys of a rule: name, type, unit, allowed, default, help, required"},
        {"rules", "array of maps", "",
         "Rules in force by their keys; origin: configuration, call or feature (FaultPercent); "
         "struck: packets, frames or commands"},
        {"frame", "integer", "",
         "Number of the newest frame as `first` and `last` count them: since the client opened its stream"}};
    calls[1].results = {{"rules", "array of maps", "", "As those of faults.list"}};
    return calls;
}

} // namespace obscura::emulator
