// SPDX-License-Identifier: Apache-2.0
// Metrics of several daemons: each sample has labels of its own.
#include "core/camera/camera_counters.hpp"
#include "host/metrics_text.hpp"
#include "tests/support/catch.hpp"

#include <nlohmann/json.hpp>

#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace metrics_text_test {

using namespace obscura;
using Json = nlohmann::ordered_json;

namespace {

Json state_of(const std::string& config, int pid) {
    return {{"daemon", {{"config", config}, {"pid", pid}, {"up_s", 3}}},
            {"threads", {{{"name", "main"}, {"cpu_s", 1}}}},
            {"cameras", {{{"acquiring", true}, {"camera", {{"frames", 7}, {"unsent", 2}}}}, Json::object()}}};
}

/// Names and labels of all samples.
std::vector<std::string> series(const std::string& text) {
    std::vector<std::string> all;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);)
        if (!line.starts_with('#')) all.push_back(line.substr(0, line.rfind(' ')));
    return all;
}

} // namespace

TEST_CASE("daemons of one configuration have samples of their own", "[tools]") {
    const std::vector<Json> states{state_of("a.toml", 7), state_of("b.toml", 8), state_of("a.toml", 9)};
    const std::string text = host::metrics_text(states);
    const std::vector<std::string> all = series(text);
    CHECK(all.size() > 20);
    CHECK(std::set(all.begin(), all.end()).size() == all.size());
    CHECK(text.find("\nobscura_up_seconds{config=\"a.toml\",pid=\"9\"} 3\n") != std::string::npos);
    CHECK(text.find("\nobscura_frames_unsent_total{config=\"a.toml\",pid=\"7\",camera=\"0\"} 2\n") !=
          std::string::npos);
    // A restart begins no new series where it need not.
    CHECK(text.find("\nobscura_up_seconds{config=\"b.toml\"} 3\n") != std::string::npos);
}

TEST_CASE("each counter of a camera has a sample, and one place on page and in packet", "[tools]") {
    Json camera;
    int value = 1000;
    std::vector<std::string> wanted;
    std::set<int> on_page, in_packet;
    std::set<std::string> families;
    const auto once = [](std::set<int>& places, int place) { CHECK(places.insert(place).second); };
    for (const Metric& metric : camera_metrics) {
        CAPTURE(metric.group, metric.name);
        camera[Json::json_pointer("/" + std::string(metric.group) + "/" + std::string(metric.name))] =
            ++value;
        if (!metric.status.empty()) once(on_page, metric.status_place);
        if (!metric.telemetry.empty()) once(in_packet, metric.telemetry_place);
        if (metric.family.empty()) continue;
        CHECK(families.insert(std::string(metric.family)).second == !metric.help.empty());
        const std::string label = metric.label.empty() ? ""
                                                       : "," + std::string(metric.label) + "=\"" +
                                                             std::string(metric.label_value) + "\"";
        wanted.push_back("\nobscura_" + std::string(metric.family) + "{config=\"\",camera=\"0\"" + label +
                         "} " + std::to_string(value) + "\n");
    }
    CHECK(wanted.size() > 20);
    const std::vector<Json> states{{{"cameras", {camera}}}};
    const std::string text = host::metrics_text(states);
    for (const std::string& sample : wanted)
        CHECK_THAT(text, Catch::Matchers::ContainsSubstring(sample));
    // From 0 on without gaps: the packet is made of them.
    CHECK(*in_packet.rbegin() == static_cast<int>(in_packet.size()) - 1);
}

} // namespace metrics_text_test
