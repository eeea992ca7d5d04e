// SPDX-License-Identifier: Apache-2.0
// The configuration key by key: the values of print_config(), and where each of them comes from.
#include "config/document.hpp"
#include "core/error.hpp"
#include "emulator/config/configuration_entries.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string>

namespace entries_test {

using namespace obscura;
using namespace obscura::emulator;

namespace {

/// Values by dotted path, those of lists of tables numbered.
void flatten(const config::Value& table, const std::string& path, std::map<std::string, config::Value>& all) {
    for (const config::Member& member : table.members) {
        const std::string here = path.empty() ? member.key : path + "." + member.key;
        const config::Value& value = member.value;
        const bool tables = value.kind == config::Value::Kind::array && !value.items.empty() &&
                            value.items.front().kind == config::Value::Kind::table;
        if (value.kind == config::Value::Kind::table)
            flatten(value, here, all);
        else if (!tables)
            all[here] = value;
        for (std::size_t i = 0; tables && i < value.items.size(); ++i)
            flatten(value.items[i], fmt::format("{}[{}]", here, i), all);
    }
}

bool same(const config::Value& a, const config::Value& b) {
    return a.kind == b.kind && a.boolean == b.boolean && a.integer == b.integer && a.real == b.real &&
           a.string == b.string &&
           std::equal(a.items.begin(), a.items.end(), b.items.begin(), b.items.end(), same);
}

/// The entries have the keys and values of the printed configuration, no more and no less.
void check_against_print(const DaemonConfig& config) {
    std::map<std::string, config::Value> printed;
    flatten(config::parse_text(print_config(config), "printed"), "", printed);
    std::map<std::string, config::Value> listed;
    for (const config::Entry& entry : configuration_entries(config)) {
        INFO(entry.key);
        CHECK(listed.count(entry.key) == 0);
        listed[entry.key] = config::parse_text("x = " + entry.value, "entry").members.at(0).value;
    }
    CHECK(listed.size() > 100);
    for (const auto& [key, value] : printed) {
        INFO(key);
        REQUIRE(listed.count(key) == 1);
        CHECK(same(listed[key], value));
    }
    CHECK(listed.size() == printed.size());
}

const config::Entry& entry_of(const std::vector<config::Entry>& entries, const std::string& key) {
    const auto found = std::find_if(entries.begin(), entries.end(),
                                    [&key](const config::Entry& entry) { return entry.key == key; });
    INFO(key);
    REQUIRE(found != entries.end());
    return *found;
}

constexpr const char* small_scene = "[[body]]\nshape = \"ellipsoid\"\nradii_m = [3, 2, 1]\nalbedo = 0.2\n";

} // namespace

TEST_CASE("each key of the configuration is listed with its value, default and source") {
    const test::TempFolder folder;
    folder.write("scene.toml", small_scene);
    const std::string sensor = folder
                                   .write("x.toml", R"(name = "X100"
[readout]
width = { value = 800, provenance = "datasheet" }
height = 600
)")
                                   .string();
    const std::string file = folder
                                 .write("c.toml", R"([scene]
file = "scene.toml"
[trigger]
rate_hz = 7.5
[sensor]
file = "x.toml"
readout.height = 400
[gige]
[[gige.faults]]
kind = "lose"
[[gige.faults]]
kind = "delay"
amount = 30
[camera]
pixel_format = "Mono16"
)")
                                 .string();
    const DaemonConfig config = load_config(file);
    check_against_print(config);
    const std::vector<config::Entry> entries = configuration_entries(config);
    const auto check = [&](const std::string& key, const std::string& value, const std::string& unit,
                           const std::string& by_default, const std::string& source) {
        const config::Entry& entry = entry_of(entries, key);
        INFO(key);
        CHECK(entry.value == value);
        CHECK(entry.unit == unit);
        CHECK(entry.by_default == by_default);
        CHECK(entry.source == source);
    };
    check("trigger.rate_hz", "7.5", "Hz", "10.0", file + ":4");
    check("sensor.readout.width", "800", "px", "1024", sensor + ":3");
    check("sensor.readout.height", "400", "px", "1024", file + ":7");
    check("gige.faults[1].amount", "30.0", "", "1.0", file + ":13");
    check("gige.faults[0].amount", "1.0", "", "1.0", "default");
    check("gige.faults[0].kind", "\"lose\"", "", "", file + ":10");
    check("gige.packet_size", "1500", "bytes", "1500", "default");

    const DaemonConfig other = with_scene(config, folder.write("other.toml", small_scene));
    const std::vector<config::Entry> after = configuration_entries(other);
    CHECK(entry_of(after, "scene.file").source == "scene.show");
    CHECK(entry_of(after, "trigger.rate_hz").source == file + ":4");
}

TEST_CASE("values of reloadable keys change together, and keep what the file and others have set") {
    const test::TempFolder folder;
    folder.write("scene.toml", small_scene);
    const DaemonConfig config = load_config(folder.write(
        "c.toml", "[scene]\nfile = \"scene.toml\"\n[trigger]\nrate_hz = 7.5\n[gige]\nenabled = false\n"));
    const DaemonConfig shown = with_scene(config, folder.write("other.toml", small_scene));
    const auto changed = [&](const std::string& text) {
        return configuration_entries(with_values(shown, config::parse_text(text, "test"), "someone"));
    };
    const std::vector<config::Entry> after =
        changed("[trigger]\nrate_hz = 20\n[deadline]\npolicy = \"drop\"\n[daemon]\nlog_level = \"debug\"\n");
    CHECK(entry_of(after, "trigger.rate_hz").value == "20.0");
    CHECK(entry_of(after, "trigger.rate_hz").source == "someone");
    CHECK(entry_of(after, "deadline.policy").value == "\"drop\"");
    CHECK(entry_of(after, "daemon.log_level").value == "\"debug\"");
    CHECK(entry_of(after, "deadline.grace_us").source == "default");
    CHECK(entry_of(after, "scene.file").source == "scene.show");
    const std::vector<config::Entry> before = configuration_entries(shown);
    const auto differing =
        static_cast<int>(std::count_if(after.begin(), after.end(), [&](const config::Entry& entry) {
            return entry.value != entry_of(before, entry.key).value;
        }));
    CHECK(differing == 3);

    const auto refusal = [&](const std::string& text) {
        try {
            (void)changed(text);
        } catch (const ConfigError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    CHECK(refusal("[trigger]\nrate_hz = 2e12\n").find("trigger.rate_hz: ") != std::string::npos);
    CHECK(refusal("[trigger]\nrate_hx = 3\n").find("did you mean \"trigger.rate_hz\"") != std::string::npos);
    for (const char* text :
         {"[gige]\nport = 3\n", "[scene]\nfile = \"demo\"\n", "[nothing]\nx = 1\n", "trigger = 3\n",
          "[deadline]\npolicy = \"never\"\n", "[trigger]\nrate_hz = \"x\"\n"}) {
        CAPTURE(text);
        CHECK(refusal(text).starts_with("someone"));
    }
}

TEST_CASE("keys of several cameras are told apart, and shared ones have the line of the shared table") {
    const test::TempFolder folder;
    folder.write("scene.toml", "[camera]\nfocal_length_mm = 70\n");
    const std::string file = folder
                                 .write("c.toml", R"([scene]
file = "scene.toml"
[gige]
packet_size = 8000
[[gige.faults]]
kind = "lose"
[[camera]]
gain_db = 3
gige = { interface = "127.0.0.2", serial = "A" }
[[camera]]
[camera.view]
focal_length_mm = 35
[camera.gige]
interface = "127.0.0.3"
serial = "B"
faults = []
)")
                                 .string();
    const DaemonConfig config = load_config(file);
    check_against_print(config);
    const std::vector<config::Entry> entries = configuration_entries(config);
    CHECK(entry_of(entries, "camera[0].gain_db").source == file + ":8");
    CHECK(entry_of(entries, "camera[1].gain_db").source == "default");
    CHECK(entry_of(entries, "camera[0].gige.packet_size").source == file + ":4");
    CHECK(entry_of(entries, "camera[1].gige.packet_size").source == file + ":4");
    CHECK(entry_of(entries, "camera[0].gige.faults[0].kind").source == file + ":6");
    CHECK(entry_of(entries, "camera[1].gige.serial").source == file + ":15");
    CHECK(entry_of(entries, "camera[1].view.focal_length_mm").source == file + ":12");
    CHECK(entry_of(entries, "trigger.rate_hz").source == "default");
}

TEST_CASE("the digest is that of what the configuration does") {
    const test::TempFolder folder;
    folder.write("scene.toml", small_scene);
    const auto digest = [&](const std::string& name, const std::string& text) {
        return configuration_sha256(configuration_entries(
            load_config(folder.write(name, "[scene]\nfile = \"scene.toml\"\n" + text))));
    };
    const std::string one = digest("a.toml", "");
    CHECK(one.size() == 64);
    CHECK(one ==
          digest("b.toml", "# another file, and a default that is written out\n[trigger]\nrate_hz = 10\n"));
    CHECK(one != digest("c.toml", "[trigger]\nrate_hz = 10.5\n"));
    // SHA-256 of no bytes, FIPS 180-4.
    CHECK(configuration_sha256({}) == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

} // namespace entries_test
