// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: parameters of requests, by the tables that say what is allowed: those of the calls to a
// camera, of the web server's queries and bodies. Whatever they hold, they are read within their ranges or
// refused in one line.
//
// Input: a byte that chooses the parser, one that chooses the row of its table, then the text.
#include "emulator/control/camera_calls.hpp"
#include "emulator/control/configuration_call.hpp"
#include "emulator/control/daemon_calls.hpp"
#include "emulator/control/device_calls.hpp"
#include "emulator/control/fault_calls.hpp"
#include "emulator/control/frame_call.hpp"
#include "emulator/control/pixel_probes.hpp"
#include "emulator/control/probe_call.hpp"
#include "emulator/control/ring_calls.hpp"
#include "emulator/control/scene_call.hpp"
#include "emulator/control/timing_call.hpp"
#include "emulator/control/truth_call.hpp"
#include "service/failure.hpp"
#include "tests/fuzz/scratch_folder.hpp"
#include "web/api/fields.hpp"
#include "web/server/problem.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

using namespace obscura;
using nlohmann::ordered_json;
using test::require;

namespace {

/// The rows of a daemon without cameras.
const service::Calls& calls() {
    using namespace emulator;
    static const CameraCalls::Cameras cameras;
    static CameraCalls of_camera(cameras);
    static PixelProbes probes{CoreSet()};
    static SceneRequests requests;
    static const service::Calls rows = [] {
        service::Calls all = of_camera.calls();
        for (service::Call& call : fault_calls(cameras))
            all.push_back(std::move(call));
        all.push_back(frame_call(cameras));
        all.push_back(stream_call(cameras));
        all.push_back(timing_call(cameras));
        all.push_back(truth_call(cameras));
        all.push_back(probe_call(cameras, probes, nullptr));
        for (const service::Calls& more :
             {ring_calls({nullptr}, nullptr), device_calls(cameras), daemon_calls(cameras, requests, nullptr),
              scene_calls(requests, std::filesystem::path(), nullptr, nullptr),
              configuration_calls(requests, nullptr)})
            all.insert(all.end(), more.begin(), more.end());
        return all;
    }();
    return rows;
}

void camera_call(std::uint8_t row, std::string_view text) {
    const nlohmann::json head = nlohmann::json::parse(text, nullptr, false);
    if (!head.is_object()) return;
    try {
        (void)service::bind(calls()[row % calls().size()], head);
    } catch (const service::Failure& failure) {
        const std::string_view why = failure.what();
        require(!why.empty() && why.find('\n') == std::string_view::npos);
    }
}

/// Whether a value is one that the table allows.
bool is_allowed(const ordered_json& value, const web::Parameter& field) {
    using Type = web::Parameter::Type;
    const auto in_range = [&] {
        return value.get<double>() >= field.min && value.get<double>() <= field.max;
    };
    switch (field.type) {
    case Type::boolean:
        return value.is_boolean();
    case Type::integer:
        return value.is_number_integer() && in_range();
    case Type::number:
        return value.is_number() && in_range();
    case Type::string:
        return value.is_string();
    case Type::array:
        return value.is_array() && (field.size == 0 || value.size() == field.size);
    case Type::object:
        return value.is_object();
    case Type::any:
        return true;
    }
    return false;
}

void check_fields(const ordered_json& values, std::span<const web::Parameter> fields) {
    require(values.is_object());
    for (const auto& [name, value] : values.items()) {
        const auto field = std::find_if(fields.begin(), fields.end(),
                                        [&name = name](const auto& one) { return one.name == name; });
        require(field != fields.end() && is_allowed(value, *field));
    }
}

void web_request(std::uint8_t row, bool query, std::string_view text) {
    const web::Route& route = web::routes()[row % web::routes().size()];
    try {
        if (query) {
            check_fields(web::read_query(text, route.query), route.query);
        } else {
            const ordered_json body = web::read_body(text, route);
            require(body.is_object());
            if (route.body != web::Body::map) check_fields(body, route.fields);
        }
    } catch (const web::Refusal& refusal) {
        require(refusal.response.status == 422 || (!query && refusal.response.status == 400));
        require(ordered_json::parse(refusal.response.body).is_object());
    }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size < 2) return 0;
    const std::string_view text(reinterpret_cast<const char*>(data + 2), size - 2);
    switch (data[0] % 4) {
    case 0:
    case 1:
        camera_call(data[1], text);
        break;
    default:
        web_request(data[1], data[0] % 4 == 2, text);
    }
    return 0;
}
