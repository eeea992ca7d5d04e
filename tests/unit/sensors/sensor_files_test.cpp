// SPDX-License-Identifier: Apache-2.0
// The shipped sensors: every number says where it comes from, and the chip they describe works.
#include "config/document.hpp"
#include "core/error.hpp"
#include "sensors/sensor.hpp"
#include "sensors/sensor_file.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <fstream>
#include <set>

namespace sensor_files_test {

using namespace obscura;
using Catch::Matchers::ContainsSubstring;

namespace {

const std::filesystem::path folder = std::filesystem::path(OBSCURA_SOURCE_DIR) / "config/sensors";

void check_provenance(const config::Value& table, const std::string& path) {
    for (const config::Member& member : table.members) {
        INFO(path << member.key);
        REQUIRE(member.value.kind == config::Value::Kind::table);
        if (member.value.find("value") == nullptr) {
            check_provenance(member.value, path + member.key + ".");
            continue;
        }
        const config::Member* provenance = member.value.find("provenance");
        const config::Member* source = member.value.find("source");
        REQUIRE(provenance != nullptr);
        REQUIRE(source != nullptr);
        const std::set<std::string> words{"verified", "derived", "default"};
        CHECK(words.count(provenance->value.string) == 1);
        CHECK(source->value.string.size() > 5);
    }
}

} // namespace

TEST_CASE("the shipped sensors are complete, sourced and usable") {
    const std::string name = GENERATE("has2", "has3-like", "generic", "imx-3.45um", "cmv4000", "star250");
    const std::filesystem::path file = folder / (name + ".toml");
    INFO(name);
    check_provenance(config::parse_file(file), "");
    const SensorDescription d = sensors::load_sensor(file);
    CHECK(sensors::explain_invalid(d.detector) == "");
    sensors::ReadoutPlan plan;
    const sensors::WindowRequest whole{{0, 0, d.readout.width, d.readout.height}, 10 * ns_per_ms};
    CHECK(plan_readout(d.readout, {&whole, 1}, Time{}, plan) == "");
}

TEST_CASE("the sensors keep the frame times of their sources") {
    sensors::ReadoutPlan plan;
    const auto readout = [&](const char* name, Region region) {
        const SensorDescription d = sensors::load_sensor(folder / name);
        if (region.width == 0) region = {0, 0, d.readout.width, d.readout.height};
        const sensors::WindowRequest window{region, ns_per_ms};
        REQUIRE(plan_readout(d.readout, {&window, 1}, Time{}, plan) == "");
        return static_cast<double>(plan.readout_ns) * 1e-6;
    };
    using Catch::Matchers::WithinAbs;
    CHECK_THAT(readout("has2.toml", {}), WithinAbs(217.9, 0.05));
    CHECK_THAT(readout("has2.toml", {500, 500, 20, 20}), WithinAbs(0.240, 1e-6));
    CHECK_THAT(readout("imx-3.45um.toml", {}), WithinAbs(1000 / 47.5, 0.01));
    CHECK_THAT(readout("cmv4000.toml", {}), WithinAbs(129 * 2048 * 1e-4, 1e-6)); // 129 clocks of 100 ns a row
    CHECK(readout("star250.toml", {}) > 1000.0 / 30);
}

TEST_CASE("sensor files that cannot be used are refused with one line") {
    const std::filesystem::path file = std::filesystem::path(OBSCURA_BINARY_DIR) / "broken_sensor.toml";
    const auto refusal = [&](const std::string& text) {
        std::ofstream(file) << text;
        try {
            static_cast<void>(sensors::load_sensor(file));
        } catch (const ConfigError& error) {
            std::filesystem::remove(file);
            return std::string(error.what());
        }
        return std::string("accepted");
    };
    CHECK_THAT(refusal(""), ContainsSubstring("empty"));
    CHECK_THAT(refusal("[detector]\nfull_well_e = -5\n"), ContainsSubstring("full_well_e"));
    CHECK_THAT(refusal("[detector]\nread_noise_e = nan\n"), ContainsSubstring("read_noise_e"));
    CHECK_THAT(refusal("[detector]\ndark_law = \"cubic\"\n"), ContainsSubstring("band-gap"));
    CHECK_THAT(refusal("[detector]\nresponse_map = \"nowhere.fits\"\n"), ContainsSubstring("nowhere.fits"));
    CHECK_THAT(refusal("[readout]\nreset_instant_ns = 5000\n"), ContainsSubstring("reset_instant_ns"));
    CHECK_THAT(refusal("[detector]\nful_well_e = 5\n"), ContainsSubstring("full_well_e"));
}

} // namespace sensor_files_test
