// SPDX-License-Identifier: Apache-2.0
#include "web/api/readiness.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <string>

namespace obscura::web {
namespace {

using Json = nlohmann::ordered_json;

constexpr double max_silence_s = 5;

std::string text_at(const Json& json, const char* pointer) {
    return json.value(Json::json_pointer(pointer), std::string());
}

class Checks {
public:
    void add(const std::string& what, bool good, const std::string& text) {
        result_.checks[what] = text;
        result_.ready = result_.ready && good;
    }
    void add_threads(const std::string& daemon, const Json& state) {
        std::string silent;
        for (const Json& beat : state.value("heartbeats", Json::array()))
            if (const double age = beat.value("age_s", 0.0);
                !beat.value("silent", true) && age > max_silence_s)
                silent += fmt::format("{}{} for {:.0f} s", silent.empty() ? "silent: " : ", ",
                                      beat.value("name", std::string()), age);
        add(daemon + " threads", silent.empty(), silent.empty() ? "beat" : silent);
    }
    void add_camera(const std::string& name, const Json& camera) {
        const Json& verdict = camera.at("verdict");
        add(name, verdict.at("health") != "bad", verdict.at("text"));
        const std::string clock = text_at(camera, "/clock/state"), source = text_at(camera, "/clock/source");
        // Edges of lines may come as they like; these have a reference.
        const bool wants_lock = source == "pps" || source.starts_with("ptp");
        add(name + " clock", clock != "holdover" && !(wants_lock && clock == "free"),
            fmt::format("{}, {}", source, clock));
        if (!camera.contains(Json::json_pointer("/transports/file"))) return;
        const std::string trouble = text_at(camera, "/transports/file/trouble");
        add(name + " files", trouble.empty(), trouble.empty() ? "are written" : trouble);
    }
    [[nodiscard]] Readiness result() && { return std::move(result_); }

private:
    Readiness result_{true, Json::object()};
};

} // namespace

Readiness readiness_of(const Sighting& sighting) {
    Checks checks;
    const bool some = !sighting.states.empty();
    checks.add("daemon", some, some ? "answers" : sighting.error);
    for (const auto& [path, why] : sighting.silent)
        checks.add(path, false, why);
    for (const Json& state : sighting.states) {
        const auto daemon = state.at("daemon").at("config").get<std::string>();
        if (const std::string starting = text_at(state, "/daemon/starting/text"); !starting.empty())
            checks.add(daemon, false, starting);
        checks.add_threads(daemon, state);
        for (std::size_t k = 0; k < state.at("cameras").size(); ++k)
            checks.add_camera(fmt::format("{} camera {}", daemon, k), state["cameras"][k]);
    }
    return std::move(checks).result();
}

} // namespace obscura::web
