// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/device_calls.hpp"

#include "config/document.hpp"
#include "core/text/printable.hpp"
#include "transports/device_features.hpp"

#include <fmt/format.h>

#include <string>
#include <type_traits>
#include <utility>
#include <variant>

namespace obscura::emulator {
namespace {

using nlohmann::json;
using service::Answer;
using service::bad_argument;
using service::Failure;
using service::FailureCode;
using service::Fields;
using service::Permission;
using transports::DeviceFeatures;

struct Written : CameraNumber { // NOLINT(bugprone-exception-escape): json does not throw when moved
    std::string name;
    json value;

    Fields fields() {
        Fields all = CameraNumber::fields();
        all.keys.push_back(
            config::key("name", &name).required().help("Feature, as device.features names it"));
        all.free.push_back(
            {"value", "number, text or boolean", "New value; true runs a command", &value, true});
        return all;
    }
};

json json_of(const DeviceFeatures::Value& value) {
    return std::visit(
        [](const auto& held) {
            if constexpr (std::is_same_v<std::decay_t<decltype(held)>, std::monostate>)
                return json();
            else
                return json(held);
        },
        value);
}

json json_of(const DeviceFeatures::Row& row) {
    json out{{"name", row.name},
             {"category", row.category},
             {"type", row.type},
             {"value", json_of(row.value)},
             {"visibility", row.visibility},
             {"writable", row.writable},
             {"locked", row.locked}};
    for (const auto& [name, text] : {std::pair{"unit", row.unit}, std::pair{"help", row.help}})
        if (!text.empty()) out[name] = text;
    for (const auto& [name, bound] : {std::pair{"min", row.minimum}, std::pair{"max", row.maximum},
                                      std::pair{"increment", row.increment}})
        if (bound) out[name] = *bound;
    if (!row.entries.empty()) out["entries"] = row.entries;
    return out;
}

/// What a feature can take. Throws Failure for anything else.
DeviceFeatures::Value value_of(const json& value) {
    if (value.is_boolean()) return value.get<bool>();
    if (value.is_number_integer()) return value.get<std::int64_t>();
    if (value.is_number()) return value.get<double>();
    if (value.is_string()) return value.get<std::string>();
    throw bad_argument("value", "device.set: value: allowed a number, a text, true or false");
}

Answer list(const ControlledCamera& camera) {
    std::vector<DeviceFeatures::Row> rows;
    if (camera.device != nullptr)
        camera.run([&](const std::string& /*controller*/) { rows = camera.device->list(); });
    json list = json::array();
    for (const DeviceFeatures::Row& row : rows)
        list.push_back(json_of(row));
    return {{{"features", std::move(list)}}};
}

Answer set(const ControlledCamera& camera, const Written& wanted) {
    if (camera.device == nullptr)
        throw Failure(FailureCode::not_now,
                      "device.set: no transport of this camera has features of its own");
    const DeviceFeatures::Value value = value_of(wanted.value);
    camera.run([&](const std::string& controller) {
        if (!controller.empty())
            throw Failure(FailureCode::controlled, fmt::format("controlled by {}", controller));
        if (const std::string why = camera.device->set(wanted.name, value); !why.empty())
            throw bad_argument(wanted.name,
                               fmt::format("device.set: {}: {}", printable(wanted.name, 60), why));
    });
    return {};
}

} // namespace

service::Calls device_calls(const CameraCalls::Cameras& cameras) {
    service::Call features = service::call<CameraNumber>(
        "device.features", Permission::view,
        "Lists the features of the camera's GigE Vision side with the values that a client reads; "
        "none where the camera has no such side.",
        [&cameras](const CameraNumber& which, service::Work& /*work*/) {
            return list(checked_camera(cameras, which.camera));
        });
    features.results = {
        {"features", "array of maps", "",
         "name, with the item in brackets where a selector chooses one: TriggerMode[FrameStart]; "
         "category; type; value, nil for commands; unit; min, max, increment; entries; visibility; "
         "writable; locked: not while it acquires; help"}};
    service::Call write = service::call<Written>(
        "device.set", Permission::operate,
        "Writes a feature of the camera's GigE Vision side, or runs one of its commands, as a client would. "
        "Answers \"controlled\" as camera.set does.",
        [&cameras](const Written& written, service::Work& /*work*/) {
            return set(checked_camera(cameras, written.camera), written);
        });
    return {std::move(features), std::move(write)};
}

} // namespace obscura::emulator
