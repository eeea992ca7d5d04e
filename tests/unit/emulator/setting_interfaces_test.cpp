// SPDX-License-Identifier: Apache-2.0
// Range, unit, default, lock and words of each camera setting, as every interface describes them, against the
// setting table. The call camera.features: camera_calls_test.cpp.
#include "core/camera/setting_table.hpp"
#include "core/clock.hpp"
#include "emulator/config/camera_section.hpp"
#include "instrument/packets/descriptions.hpp"
#include "instrument/scpi/reference.hpp"
#include "tests/support/catch.hpp"
#include "transports/gige/channels/message_channel.hpp"
#include "transports/gige/device/device.hpp"
#include "transports/gige/device/feature_table.hpp"
#include "transports/gige/device_features.hpp"
#include "transports/gige/genicam/description.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace setting_interfaces_test {

using namespace obscura;
using namespace obscura::emulator;
namespace gige = obscura::transports::gige;

namespace {

using Words = std::set<std::string, std::less<>>;

Words words_of(const Setting& setting) {
    Words words;
    for (const SettingWord& word : setting.member.words)
        words.emplace(word.name);
    return words;
}

std::vector<const Setting*> all_settings() {
    std::vector<const Setting*> all;
    for (const Setting& setting : camera_settings_table)
        all.push_back(&setting);
    for (const Setting& setting : window_settings_table)
        all.push_back(&setting);
    return all;
}

/// Equal but for the digits that a text or a scale costs.
bool is_near(double a, double b) {
    return std::abs(a - b) <= 1e-12 * std::abs(b);
}

void check_range(const std::optional<SettingRange>& expected, std::optional<double> minimum,
                 std::optional<double> maximum) {
    REQUIRE(minimum.has_value() == expected.has_value());
    REQUIRE(maximum.has_value() == expected.has_value());
    if (!expected) return;
    CHECK(is_near(*minimum, expected->minimum));
    CHECK(is_near(*maximum, expected->maximum));
}

void check_key(const config::Key& key, const Setting& setting, bool zero_allowed) {
    CHECK(key.unit() == setting.unit);
    CHECK(key.help().find(setting.help) != std::string_view::npos);
    if (const std::optional<SettingRange> range = widest_range(setting)) {
        CHECK(key.range().min == (zero_allowed ? 0 : range->minimum));
        CHECK(key.range().max == range->maximum);
    } else {
        CHECK(std::isinf(key.range().max));
    }
    const Words words = words_of(setting);
    for (const std::string_view choice : key.choices())
        CHECK((words.contains(choice) || choice == "auto"));
}

/// What group `group` of the first match of `pattern` in `text` holds; empty if there is none.
std::string matched(const std::string& text, const std::string& pattern, std::size_t group = 1) {
    std::smatch match;
    return std::regex_search(text, match, std::regex(pattern)) ? match[group].str() : std::string();
}

double number(const std::string& text) {
    REQUIRE(!text.empty());
    return std::strtod(text.c_str(), nullptr);
}

/// Shows what it is given; its limits differ from those of CameraLimits.
struct PaperCamera final : CameraControl {
    CameraLimits limits_;
    CameraSettings settings_;
    bool running = false;

    PaperCamera() {
        limits_.sensor_width = 640;
        limits_.sensor_height = 480;
        limits_.black_level_max_dn = 512;
        limits_.gain_min_db = 2, limits_.gain_max_db = 20;
        limits_.exposure_min_ns = 3000, limits_.exposure_max_ns = 4 * ns_per_s;
        limits_.frame_rate_min_hz = 0.5, limits_.frame_rate_max_hz = 70;
        // A window of one pixel leaves its offsets all of their range.
        settings_.region = {0, 0, 1, 1};
        settings_.gain_db = 3;
    }
    [[nodiscard]] CameraLimits limits() const override { return limits_; }
    [[nodiscard]] CameraSettings settings() const override { return settings_; }
    bool apply(const CameraSettings& s) override {
        settings_ = s;
        return true;
    }
    bool acquisition_start() override { return !std::exchange(running, true); }
    void acquisition_stop(bool /*abort*/) override { running = false; }
    [[nodiscard]] bool acquiring() const override { return running; }
    bool software_trigger(Time /*edge*/) override { return false; }
};

struct SilentStream final : gige::StreamPort {
    bool begin(const gige::StreamConfig& /*config*/) override { return true; }
    void abort() noexcept override {}
    [[nodiscard]] bool idle() const noexcept override { return true; }
    bool wait_idle(std::int64_t /*timeout*/) noexcept override { return true; }
    void resend(const gige::ResendRequest& /*request*/) noexcept override {}
    bool send_test_packet(const gige::StreamConfig& /*config*/) noexcept override { return true; }
    [[nodiscard]] std::uint16_t source_port() const noexcept override { return 4242; }
};

/// A GigE Vision device, and its GenICam description as a client evaluates it.
struct GenicamBench {
    FakeClock clock{Time{1'000'000'000}};
    PaperCamera camera;
    SilentStream stream;
    gige::MessageChannel messages{gige::NetworkInterface{}};
    gige::Device device{gige::GigeSettings{}, gige::NetworkInterface{}, camera, stream, messages, clock};
    std::string xml = gige::describe_camera(gige::feature_table());

    /// The node of a name, from its tag to its end.
    [[nodiscard]] std::string node(const std::string& name) const {
        const std::size_t begin = xml.find("Name=\"" + name + "\"");
        INFO("node " << name);
        REQUIRE(begin != std::string::npos);
        return xml.substr(begin, xml.find("\n  </", begin) - begin);
    }
    static std::string element(const std::string& node, const std::string& tag) {
        return matched(node, "<" + tag + ">([^<]*)</" + tag + ">");
    }
    /// `tag`: "Min" or "Max". Of a float the limits are those of its integer node, scaled.
    std::optional<double> limit(const std::string& name, const std::string& tag) {
        std::string of = node(name);
        double scale = 1;
        if (const std::string formula = element(of, "FormulaFrom"); !formula.empty()) {
            scale = number(matched(formula, "TO/([0-9.]+)"));
            of = node(element(of, "pValue"));
        }
        if (const std::string fixed = element(of, tag); !fixed.empty()) return number(fixed) / scale;
        const std::string held = element(of, "p" + tag);
        if (held.empty()) return std::nullopt;
        std::uint32_t word = 0;
        const std::string address = matched(node(held), "<Address>0x([0-9A-F]+)");
        REQUIRE(device.registers().read_word(static_cast<std::uint32_t>(std::stoul(address, nullptr, 16)),
                                             word) == gige::Status::success);
        return static_cast<double>(word) / scale;
    }
    [[nodiscard]] static Words entries(const std::string& node) {
        Words words;
        const std::regex entry("<EnumEntry Name=\"([^\"]*)\"");
        for (std::sregex_iterator at(node.begin(), node.end(), entry), end; at != end; ++at)
            words.insert((*at)[1]);
        return words;
    }
};

/// Arguments of telecommands and the settings that they set.
const std::map<std::string, std::string> telecommand_arguments{{"EXPOSURE", "ExposureTime"},
                                                               {"GAIN", "Gain"},
                                                               {"BLACK_LEVEL", "BlackLevel"},
                                                               {"FRAME_RATE", "AcquisitionFrameRate"}};
constexpr std::uint16_t first_apid = 256;

} // namespace

TEST_CASE("[camera] has the units, ranges, defaults and words of the setting table") {
    CameraSection section;
    const config::Keys keys = section_of(section).keys;
    std::size_t found = 0;
    for (const Setting& setting : camera_settings_table) {
        const std::string_view name = key_of_feature(setting.name, false);
        if (name.empty()) continue;
        INFO(setting.name);
        const auto key =
            std::find_if(keys.begin(), keys.end(), [&](const auto& k) { return k.name == name; });
        REQUIRE(key != keys.end());
        ++found;
        const bool extent = setting.name == "Width" || setting.name == "Height";
        check_key(*key, setting, extent);
        const std::string text = config::value_text(*key);
        if (setting.member.words.empty())
            CHECK(number(text) == (extent ? 0 : default_of(setting)));
        else if (text != "\"auto\"")
            CHECK(text == config::toml_string(setting.word_of(default_of(setting))));
    }
    CHECK(found == 12);
}

TEST_CASE("[[camera.window]] has the units, ranges and defaults of the setting table") {
    CameraSection section;
    const config::Section window = section_of(section).lists.at(0).examples().at(0);
    const std::map<std::string_view, std::string_view> names{{"width", "Width"},
                                                             {"height", "Height"},
                                                             {"offset_x", "OffsetX"},
                                                             {"offset_y", "OffsetY"},
                                                             {"exposure_us", "ExposureTime"},
                                                             {"reads", "RegionReads"}};
    std::size_t found = 0;
    for (const config::Key& key : window.keys) {
        const auto name = names.find(key.name);
        if (name == names.end()) continue;
        INFO(key.name);
        ++found;
        const Setting& setting = *find_setting(name->second);
        check_key(key, setting, false);
        if (!key.is_required()) CHECK(number(config::value_text(key)) == default_of(setting));
    }
    CHECK(found == names.size());
}

TEST_CASE("the GenICam description has units, ranges, locks and words of the setting table") {
    GenicamBench bench;
    for (const Setting* setting : all_settings()) {
        const std::string name(setting->name);
        INFO(name);
        const std::string node = bench.node(name);
        CHECK(GenicamBench::element(node, "Unit") == setting->unit);
        CHECK(GenicamBench::element(node, "ToolTip") == setting->help);
        check_range(setting->range_of(bench.camera.limits()), bench.limit(name, "Min"),
                    bench.limit(name, "Max"));
        // A formula may lock more than the acquisition does, and other items of a selector.
        const std::string lock = GenicamBench::element(node, "pIsLocked");
        if (setting->lock == SettingLock::streaming)
            CHECK((lock == "TLParamsLocked" || lock.starts_with("LockedOr")));
        if (setting->lock == SettingLock::never) CHECK(lock != "TLParamsLocked");
        // GenICam has its own words for the reads of a window.
        if (name != "RegionSampling") CHECK(GenicamBench::entries(node) == words_of(*setting));
        const std::string category = bench.node(std::string(setting->category));
        CHECK(category.find("<pFeature>" + name + "</pFeature>") != std::string::npos);
    }
}

TEST_CASE("the features of a GigE Vision device have units, ranges and locks of the setting table") {
    GenicamBench bench;
    gige::GigeFeatures features(bench.device, bench.camera);
    REQUIRE(bench.camera.acquisition_start());
    const std::vector<transports::DeviceFeatures::Row> rows = features.list();
    for (const Setting* setting : all_settings()) {
        INFO(setting->name);
        const auto row = std::find_if(rows.begin(), rows.end(), [&](const auto& one) {
            return one.name == setting->name || one.name == std::string(setting->name) + "[Region0]" ||
                   one.name == std::string(setting->name) + "[FrameStart]";
        });
        REQUIRE(row != rows.end());
        CHECK(row->category == setting->category);
        CHECK(row->unit == setting->unit);
        CHECK(row->help == setting->help);
        CHECK(row->locked == setting->is_locked(true));
        check_range(setting->range_of(bench.camera.limits()), row->minimum, row->maximum);
    }
}

TEST_CASE("the SCPI reference has units, ranges, locks and words of the setting table") {
    const std::string page = instrument::scpi_reference();
    const std::map<std::string, std::string> headers{
        {"EXPosure\\[:TIME\\]", "ExposureTime"},
        {"GAIN", "Gain"},
        {"BLACk\\[:LEVel\\]", "BlackLevel"},
        {"FRAMe:RATE", "AcquisitionFrameRate"},
        {"IMAGe:WIDTh", "Width"},
        {"IMAGe:HEIGht", "Height"},
        {"IMAGe:PATTern", "TestPattern"},
        {"EXPosure:MODE", "ExposureMode"},
        {"EXPosure:AUTO", "ExposureAuto"},
        {"TRIGger\\[:SEQuence\\]:MODE", "TriggerMode"},
        {"TRIGger\\[:SEQuence\\]:SOURce", "TriggerSource"},
        {"TRIGger\\[:SEQuence\\]:ACTivation", "TriggerActivation"},
        {"TRIGger\\[:SEQuence\\]:DELay", "TriggerDelay"}};
    for (const auto& [header, name] : headers) {
        INFO(header);
        const Setting& setting = *find_setting(name);
        const std::string line = matched(page, "(\\| `\\[CAMera#:\\]" + header + " <[^\n]*)\n");
        CHECK(matched(line, "\\| ([^|]*) \\|$") == help_with_lock(setting));
        const std::optional<SettingRange> range = widest_range(setting);
        if (!range) {
            Words words;
            const std::string given = matched(line, "<([^>]*)>");
            const std::regex word("[A-Za-z0-9]+");
            for (std::sregex_iterator at(given.begin(), given.end(), word), end; at != end; ++at)
                if (at->str() != "or") words.insert(at->str());
            CHECK(words == words_of(setting));
            continue;
        }
        const std::string unit = matched(line, "<[^ ]+ to [^ >]+ ?([^>]*)>");
        const double per_unit = setting.unit == "us" ? 1e6 : 1; // SCPI has seconds
        CHECK(unit == (setting.unit == "us" ? "s" : setting.unit));
        check_range(range, number(matched(line, "<([^ ]+) to ")) * per_unit,
                    number(matched(line, " to ([^ >]+)")) * per_unit);
    }
}

TEST_CASE("XTCE, COSMOS and the packet page have units, ranges and defaults of the setting table") {
    const std::string xtce = instrument::xtce_description(first_apid);
    const std::string cosmos = instrument::cosmos_commands(first_apid);
    const std::string page = instrument::packet_page(first_apid);
    for (const auto& [argument, name] : telecommand_arguments) {
        INFO(argument);
        const Setting& setting = *find_setting(name);
        const std::optional<SettingRange> range = widest_range(setting);
        const std::string type = matched(xtce, "(<FloatArgumentType name=\"" + argument + "\"[^\n]*)\n");
        CHECK(matched(type, "<Unit>([^<]*)</Unit>") == setting.unit);
        check_range(range, number(matched(type, "minInclusive=\"([^\"]*)\"")),
                    number(matched(type, "maxInclusive=\"([^\"]*)\"")));
        CHECK(matched(xtce, "<Argument name=\"" + argument + "\"[^\n]* shortDescription=\"([^\"]*)\"") ==
              setting.help);

        const std::string line = "APPEND_PARAMETER " + argument +
                                 " 64 FLOAT ([^ ]+) ([^ ]+) ([^ ]+) \"([^\"]*)\"\n"
                                 "    UNITS ([^ ]+)";
        check_range(range, number(matched(cosmos, line, 1)), number(matched(cosmos, line, 2)));
        CHECK(number(matched(cosmos, line, 3)) == default_of(setting));
        CHECK(matched(cosmos, line, 4) == setting.help);
        CHECK(matched(cosmos, line, 5) == setting.unit);

        const std::string cell = "`" + argument + "` f64 ([^ ]+) to ([^ ]+) ([^ ]+) ";
        check_range(range, number(matched(page, cell, 1)), number(matched(page, cell, 2)));
        CHECK(matched(page, cell, 3) == setting.unit);
    }
    const std::string source = matched(cosmos, "APPEND_PARAMETER SOURCE 8 UINT 0 4 ([0-9])");
    CHECK(matched(cosmos, "STATE ([A-Z0-9]+) " + source + "\n", 1) != "");
    CHECK(matched(cosmos.substr(cosmos.find("APPEND_PARAMETER SOURCE")),
                  "STATE ([A-Z0-9]+) " + source + "\n") == "LINE0");
    CHECK(setting("TriggerSource").word_of(default_of(setting("TriggerSource"))) == "Line0");
}

} // namespace setting_interfaces_test
