// SPDX-License-Identifier: Apache-2.0
// Commands that take the state of a scene away and bring it back: places, light and camera, not the objects.
#include "core/text/printable.hpp"
#include "serve/compatible/client_state.hpp"
#include "serve/compatible/handlers.hpp"
#include "service/failure.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace obscura::serve::compatible {
namespace {

using nlohmann::json;

constexpr int state_version = 1;

json json_of(const Vec3& v) {
    return {v.x, v.y, v.z};
}
json json_of(const Quat& q) {
    return {q.w, q.x, q.y, q.z};
}

/// Doubles as text are read back to the same bits.
json state_of(const ClientState& client_state) {
    json objects = json::object();
    for (const auto& [name, object] : client_state.objects) {
        const Placement& p = object.placement;
        objects[name] = {{"position_m", json_of(p.position_m)},
                         {"attitude", json_of(p.attitude)},
                         {"velocity_m_s", json_of(p.velocity_m_s)},
                         {"rate_rad_s", json_of(p.rate_rad_s)},
                         {"element_position_m", json_of(p.element.position_m)},
                         {"element_attitude", json_of(p.element.orientation)}};
    }
    const CameraSettings& c = client_state.camera;
    return {{"state", state_version},
            {"objects", std::move(objects)},
            {"sun_power_w_sr", client_state.sun_power_w_sr},
            {"size", {c.width, c.height}},
            {"fov_rad", {c.fov_x_rad, c.fov_y_rad}},
            {"integration_s", c.integration_s},
            {"samples", client_state.rendering.samples},
            {"irradiance", client_state.rendering.irradiance}};
}

[[noreturn]] void refuse(const Arguments& arguments, const std::string& what) {
    throw arguments.refused("state", what, "what getState has answered");
}

/// Numbers called `name` of a table.
std::vector<double> numbers(const Arguments& arguments, const json& table, const char* name,
                            std::size_t count) {
    const auto found = table.find(name);
    if (found == table.end() || !found->is_array() || found->size() != count)
        refuse(arguments, fmt::format("{} is missing, or not {} numbers", name, count));
    std::vector<double> out;
    for (const json& number : *found) {
        if (!number.is_number() || !std::isfinite(number.get<double>()))
            refuse(arguments, fmt::format("{} has no finite number", name));
        out.push_back(number.get<double>());
    }
    return out;
}

double number_within(const Arguments& arguments, const json& table, const char* name, double least,
                     double most) {
    const auto found = table.find(name);
    if (found == table.end() || !found->is_number())
        refuse(arguments, fmt::format("{} is missing, or no number", name));
    const double number = found->get<double>();
    if (!(number >= least && number <= most)) refuse(arguments, fmt::format("{} is out of range", name));
    return number;
}

/// Whether tables and lists are within each other more than a state's are: json copies and prints them by
/// recursion.
bool too_deep(std::string_view text) {
    constexpr int most = 4;
    int depth = 0;
    bool in_string = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (in_string && c == '\\')
            ++i;
        else if (c == '"')
            in_string = !in_string;
        else if (!in_string && (c == '[' || c == '{') && ++depth > most)
            return true;
        else if (!in_string && (c == ']' || c == '}'))
            --depth;
    }
    return false;
}

json parsed(const Arguments& arguments) {
    const std::string& text = arguments.text("state");
    if (too_deep(text)) refuse(arguments, "is no state");
    json state = json::parse(text, nullptr, false);
    if (!state.is_object() || state.value("state", json()) != state_version) refuse(arguments, "is no state");
    const auto objects = state.find("objects");
    if (objects == state.end() || !objects->is_object()) refuse(arguments, "has no objects");
    return state;
}

Placement placement_of(const Arguments& arguments, const json& table) {
    const auto vector = [&](const char* name) { return vec3_of(numbers(arguments, table, name, 3)); };
    const auto attitude = [&](const char* name) {
        const std::vector<double> q = numbers(arguments, table, name, 4);
        const Quat unit{q[0], q[1], q[2], q[3]};
        if (!(std::abs(norm(unit) - 1) < 1e-6))
            refuse(arguments, fmt::format("{} is no unit quaternion", name));
        return unit;
    };
    // States of before elements had a pose have none.
    const bool with_element = table.contains("element_position_m") || table.contains("element_attitude");
    return {vector("position_m"), attitude("attitude"), vector("velocity_m_s"), vector("rate_rad_s"),
            with_element ? Pose{vector("element_position_m"), attitude("element_attitude")} : Pose{}};
}

void set_state(ClientState& client_state, const Arguments& arguments, Reply& reply) {
    constexpr double max_size = 65536, max_fov = 3.14;
    const json state = parsed(arguments);
    // All is read before anything is set.
    std::vector<std::pair<Object*, Placement>> places;
    std::string unknown;
    for (const auto& [name, table] : state.at("objects").items()) {
        const Placement placement = placement_of(arguments, table);
        if (const auto found = client_state.objects.find(name); found != client_state.objects.end())
            places.emplace_back(&found->second, placement);
        else
            unknown += (unknown.empty() ? "" : ", ") + name;
    }
    const std::vector<double> power = numbers(arguments, state, "sun_power_w_sr", channels);
    CameraSettings camera = client_state.camera;
    const std::vector<double> size = numbers(arguments, state, "size", 2),
                              fov = numbers(arguments, state, "fov_rad", 2);
    for (const double edge : size)
        if (!(edge >= 1 && edge <= max_size)) refuse(arguments, "size is out of range");
    for (const double angle : fov)
        if (!(angle > 0 && angle <= max_fov)) refuse(arguments, "fov_rad is out of range");
    camera.width = static_cast<std::int32_t>(size[0]), camera.height = static_cast<std::int32_t>(size[1]);
    camera.fov_x_rad = fov[0], camera.fov_y_rad = fov[1];
    camera.integration_s = number_within(arguments, state, "integration_s", 0, 1e6);
    const double samples = number_within(arguments, state, "samples", 1, client_state.limits().samples);
    const bool irradiance = state.value("irradiance", json(false)) == true;

    for (const auto& [object, placement] : places)
        object->placement = placement;
    for (std::size_t c = 0; c < channels; ++c)
        client_state.sun_power_w_sr[c] = std::max(0.0, power[c]);
    client_state.camera = camera;
    client_state.rendering.samples = static_cast<std::uint32_t>(samples);
    client_state.rendering.irradiance = irradiance;
    if (!unknown.empty())
        reply.warn(
            fmt::format("setState: there are no objects {}; their places are not used", printable(unknown)));
}

/// Lines for people.
std::string readable(const json& state) {
    std::string text;
    for (const auto& [name, value] : state.items()) {
        if (name == "objects") continue;
        text += fmt::format("{}: {}\n", name, value.dump());
    }
    for (const auto& [name, table] : state.at("objects").items())
        for (const auto& [key, value] : table.items())
            text += fmt::format("{} {}: {}\n", name, key, value.dump());
    return text;
}

} // namespace

void add_state_calls(Handlers& handlers) {
    handlers["getState"] = [](Request& r) { r.reply.set("state", state_of(r.client_state).dump()); };
    handlers["setState"] = [](Request& r) { set_state(r.client_state, r.arguments, r.reply); };
    // An empty text: the state as it is.
    handlers["printState"] = [](Request& r) {
        const json state = r.arguments.text("state").empty() ? state_of(r.client_state) : parsed(r.arguments);
        r.reply.set("readable_state", readable(state));
    };
}

} // namespace obscura::serve::compatible
