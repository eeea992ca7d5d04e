// SPDX-License-Identifier: Apache-2.0
// Readiness checks: what makes a machine of cameras not ready, and the text that says so.
#include "tests/support/catch.hpp"
#include "web/api/readiness.hpp"

#include <nlohmann/json.hpp>

#include <string>

namespace readiness_test {

using namespace obscura::web;
using Json = nlohmann::ordered_json;

namespace {

Json good_state() {
    return {{"daemon", {{"config", "a.toml"}}},
            {"heartbeats",
             {{{"name", "render"}, {"age_s", 0.2}, {"silent", false}},
              {{"name", "probe"}, {"age_s", 900}, {"silent", true}}}},
            {"cameras",
             {{{"verdict", {{"health", "good"}, {"text", "on time"}}},
               {"clock", {{"source", "pps"}, {"state", "locked"}}},
               {"transports", {{"file", {{"trouble", ""}}}}}}}}};
}

/// Readiness of one daemon in which the value at `pointer` differs.
Readiness with(const char* pointer, const Json& value) {
    Sighting sighting;
    sighting.states.push_back(good_state());
    sighting.states.front().at(Json::json_pointer(pointer)) = value;
    return readiness_of(sighting);
}

} // namespace

TEST_CASE("a machine is ready if each check of each daemon is good", "[web]") {
    Sighting sighting;
    sighting.error = "no daemon answers";
    CHECK_FALSE(readiness_of(sighting).ready);
    CHECK(readiness_of(sighting).checks == Json{{"daemon", "no daemon answers"}});
    sighting.states.push_back(good_state());
    const Readiness found = readiness_of(sighting);
    CHECK(found.ready);
    CHECK(found.checks == Json{{"daemon", "answers"},
                               {"a.toml threads", "beat"},
                               {"a.toml camera 0", "on time"},
                               {"a.toml camera 0 clock", "pps, locked"},
                               {"a.toml camera 0 files", "are written"}});
    sighting.silent["/run/b.socket"] = "no answer within 5 s";
    CHECK_FALSE(readiness_of(sighting).ready);
    CHECK(readiness_of(sighting).checks["/run/b.socket"] == "no answer within 5 s");
}

TEST_CASE("what is wrong is said by the check that finds it", "[web]") {
    const auto text = [](const Readiness& found, const char* check) {
        return found.ready ? std::string("ready") : found.checks.at(check).get<std::string>();
    };
    CHECK(text(with("/heartbeats/0/age_s", 7.2), "a.toml threads") == "silent: render for 7 s");
    CHECK(text(with("/cameras/0/verdict", {{"health", "bad"}, {"text", "3 late rows"}}), "a.toml camera 0") ==
          "3 late rows");
    CHECK(with("/cameras/0/verdict", {{"health", "idle"}, {"text", "idle"}}).ready);
    CHECK(text(with("/cameras/0/clock/state", "holdover"), "a.toml camera 0 clock") == "pps, holdover");
    CHECK(text(with("/cameras/0/clock/state", "free"), "a.toml camera 0 clock") == "pps, free");
    CHECK(with("/cameras/0/clock", {{"source", "timer"}, {"state", "free"}}).ready);
    CHECK(text(with("/cameras/0/transports/file/trouble", "disk full"), "a.toml camera 0 files") ==
          "disk full");
}

} // namespace readiness_test
