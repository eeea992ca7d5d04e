// SPDX-License-Identifier: Apache-2.0
#include "tools/pages/status_text.hpp"

#include "core/camera/camera_counters.hpp"
#include "core/text/printable.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <map>

namespace obscura::tools {
namespace {

using Json = nlohmann::ordered_json;

const Json& at(const Json& json, const char* path) {
    static const Json missing;
    const Json::json_pointer pointer(path);
    return json.contains(pointer) ? json.at(pointer) : missing;
}

std::string text_at(const Json& json, const char* path) {
    const Json& value = at(json, path);
    return value.is_string() ? for_terminal(value.get<std::string>()) : "-";
}

std::string number_at(const Json& json, const char* path) {
    const Json& value = at(json, path);
    if (value.is_number_integer()) return fmt::format("{}", value.get<std::int64_t>());
    return value.is_number() ? fmt::format("{:.6g}", value.get<double>()) : "-";
}

bool flag_at(const Json& json, const char* path) {
    const Json& value = at(json, path);
    return value.is_boolean() && value.get<bool>();
}

std::string span_text(double seconds) {
    const auto s = static_cast<std::int64_t>(seconds);
    if (s >= 86400) return fmt::format("{} d {} h", s / 86400, s % 86400 / 3600);
    if (s >= 3600) return fmt::format("{} h {} min", s / 3600, s % 3600 / 60);
    return s >= 60 ? fmt::format("{} min {} s", s / 60, s % 60) : fmt::format("{} s", s);
}

std::string uptime_text(const Json& us) {
    if (!us.is_number()) return "-";
    const double value = us.get<double>();
    if (std::abs(value) >= 1e6) return fmt::format("{:.3g} s", value / 1e6);
    if (std::abs(value) >= 1e3) return fmt::format("{:.3g} ms", value / 1e3);
    return fmt::format("{:.3g} us", value);
}

std::string latency_line(const Json& camera, const char* name, const char* label) {
    const std::string path = fmt::format("/latency_us/{}", name);
    if (at(camera, (path + "/count").c_str()) == 0) return fmt::format("  {:<22}-\n", label);
    const auto quantile = [&](const char* which) {
        return uptime_text(at(camera, fmt::format("{}/{}", path, which).c_str()));
    };
    return fmt::format("  {:<22}p50 {}, p99 {}, max {}\n", label, quantile("p50"), quantile("p99"),
                       quantile("max"));
}

bool is_bad(const Json& camera) {
    return text_at(camera, "/verdict/health") == "bad";
}

bool is_starting(const Json& state) {
    return state.contains(Json::json_pointer("/daemon/starting"));
}

/// What begins a frame: the kind of Line0's source, or the other trigger that is chosen.
std::string trigger_of(const Json& camera) {
    if (at(camera, "/frame_trigger").is_null()) return text_at(camera, "/clock/source");
    if (!flag_at(camera, "/frame_trigger/on")) return "free run";
    const std::string source = text_at(camera, "/frame_trigger/source");
    return source == "Line0" ? text_at(camera, "/clock/source") : source;
}

/// The counters that the page shows, in their order on it.
std::string counters_text(const Json& camera) {
    std::map<int, std::string> places;
    for (const Metric& metric : camera_metrics)
        if (!metric.status.empty())
            places[metric.status_place] = fmt::format(
                "{} {}", number_at(camera, fmt::format("/{}/{}", metric.group, metric.name).c_str()),
                metric.status);
    std::string text;
    for (const auto& [place, words] : places)
        text += (text.empty() ? "" : ", ") + words;
    return text;
}

std::string camera_text(const Json& camera, std::size_t number) {
    const std::string controller = text_at(camera, "/controller");
    std::string text = fmt::format("camera {}  {}  {}\n", number, text_at(camera, "/address"),
                                   controller.empty() || controller == "-" ? "no client in control"
                                                                           : "controlled by " + controller);
    text += fmt::format("  {}{}\n", is_bad(camera) ? "NOT GOOD: " : "", text_at(camera, "/verdict/text"));
    text += fmt::format("  {:<22}{}, clock {}; {}\n", "trigger", trigger_of(camera),
                        text_at(camera, "/clock/state"),
                        flag_at(camera, "/trigger_ready") ? "ready" : "not ready");
    text += fmt::format("  {:<22}{}; last frame {}\n", "since the start", counters_text(camera),
                        number_at(camera, "/frame_id"));
    text += latency_line(camera, "trigger_to_first_row", "trigger to first row");
    text += latency_line(camera, "release_lateness", "release lateness");
    for (const auto& [kind, counters] : at(camera, "/transports").items()) {
        if (kind == "watch" && at(counters, "/submitted") == 0) continue; // no viewer so far
        const Json& unheard = at(counters, "/no_receiver");
        text += fmt::format("  {:<22}{} delivered, {} dropped{}\n", for_terminal(kind),
                            number_at(counters, "/delivered"), number_at(counters, "/dropped"),
                            unheard.is_number() && unheard != 0
                                ? fmt::format(" ({} while no client received)", unheard.dump())
                                : "");
    }
    return text;
}

} // namespace

std::string status_text(const Json& state) {
    const Json& up = at(state, "/daemon/up_s");
    std::string text =
        fmt::format("obscurad {}  pid {}  up {}  {} MiB  {}\n", text_at(state, "/daemon/version"),
                    number_at(state, "/daemon/pid"), up.is_number() ? span_text(up.get<double>()) : "-",
                    at(state, "/daemon/resident_mib").is_number()
                        ? fmt::format("{:.0f}", at(state, "/daemon/resident_mib").get<double>())
                        : "-",
                    text_at(state, "/daemon/config"));
    if (is_starting(state)) text += fmt::format("  {}\n", text_at(state, "/daemon/starting/text"));
    std::size_t number = 0;
    for (const Json& camera : at(state, "/cameras"))
        text += camera_text(camera, number++);
    return text;
}

bool none_bad(const Json& state) {
    if (is_starting(state)) return false;
    for (const Json& camera : at(state, "/cameras"))
        if (is_bad(camera)) return false;
    return true;
}

} // namespace obscura::tools
