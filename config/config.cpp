#include "config/config.hpp"

#include "config/sensor_file.hpp"
#include "config/tables.hpp"
#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::config {
namespace {

/// Path of the scene file inside [scene].
struct SceneSection {
    std::string file;
};

Keys keys_of(SceneSection& s) {
    return {{"file", Path{&s.file}, {}, {}, {}, "Scene file"}};
}

template<typename Section>
Given read_section(const Value& root, const Where& top, std::string_view name, Section& section) {
    const Member* member = root.find(name);
    if (member == nullptr) return {};
    const Where where = top.in(name);
    return read_keys(expect_table(member->value, where), where, keys_of(section));
}

/// Position of `key` in `section`, or of the section, or nothing.
Position position_of(const Value& root, std::string_view section, std::string_view key) {
    const Member* table = root.find(section);
    if (table == nullptr) return {};
    const Member* member = table->value.find(key);
    return member == nullptr ? table->at : member->value.at;
}

void read_faults(const Member& member, const Where& where, std::vector<FaultSection>& faults) {
    const std::vector<Value>& tables = expect_tables(member, where);
    faults.clear();
    for (std::size_t i = 0; i < tables.size(); ++i) {
        FaultSection fault;
        const Where here{where.file, fmt::format("{}[{}]", where.path, i)};
        const Given given = read_keys(tables[i], here, keys_of(fault));
        if (given.find("kind") == given.end()) fail(here, tables[i].at, "the key \"kind\" is missing");
        const auto refuse = [&](std::string_view key, std::string_view what) {
            const auto at = given.find(key);
            fail(here.in(key), at != given.end() ? at->second : tables[i].at, what);
        };
        if (fault.last != 0 && fault.last < fault.first)
            refuse("last", fmt::format("{} is before the first, {}", fault.last, fault.first));
        if (fault.kind == "delay" && !(fault.amount >= 0 && fault.amount <= 1e6))
            refuse("amount", fmt::format("{} us is no delay, allowed 0 to 1000000", fault.amount));
        if (fault.kind == "wrong_block_id" &&
            (fault.amount < 1 || fault.amount > 65535 || fault.amount != std::floor(fault.amount)))
            refuse("amount", fmt::format("{} is no distance of block ids, allowed 1 to 65535", fault.amount));
        faults.push_back(fault);
    }
}

/// [gige] of `root` with its [[gige.faults]].
void read_gige(const Value& root, const Where& top, GigeSection& gige) {
    const Member* member = root.find("gige");
    if (member == nullptr) return;
    const Where where = top.in("gige");
    const Value& table = expect_table(member->value, where);
    read_keys(table, where, keys_of(gige), {"faults"});
    if (const Member* faults = table.find("faults")) read_faults(*faults, where.in("faults"), gige.faults);
}

void check_together(const Config& config, const Value& root, const Where& top) {
    const auto refuse = [&](std::string_view section, std::string_view key, std::string_view what) {
        fail(top.in(section).in(key), position_of(root, section, key), what);
    };
    const CameraSection& camera = config.camera;
    const ReadoutSettings& readout = config.sensor.readout;
    const std::int32_t width = camera.width == 0 ? readout.width - camera.offset_x : camera.width;
    const std::int32_t height = camera.height == 0 ? readout.height - camera.offset_y : camera.height;
    if (width < 1 || camera.offset_x > readout.width - width)
        refuse("camera", camera.width == 0 ? "offset_x" : "width",
               fmt::format("columns {} to {} leave the sensor, which is {} px wide", camera.offset_x,
                           camera.offset_x + std::max(width, 1) - 1, readout.width));
    if (height < 1 || camera.offset_y > readout.height - height)
        refuse("camera", camera.height == 0 ? "offset_y" : "height",
               fmt::format("rows {} to {} leave the sensor, which is {} px high", camera.offset_y,
                           camera.offset_y + std::max(height, 1) - 1, readout.height));

    const GigeSection& gige = config.gige;
    // Sizes of the bootstrap registers, one byte less for the closing zero.
    const auto check_text = [&](std::string_view key, const std::string& text, std::size_t limit) {
        const bool ascii =
            std::all_of(text.begin(), text.end(), [](char c) { return c >= 0x20 && c < 0x7f; });
        if (text.size() > limit || !ascii)
            refuse("gige", key, fmt::format("allowed are at most {} printable ASCII characters", limit));
    };
    check_text("vendor", gige.vendor, 31);
    check_text("model", gige.model, 31);
    check_text("serial", gige.serial, 15);
    check_text("user_name", gige.user_name, 15);
    if (gige.packet_size % 4 != 0)
        refuse("gige", "packet_size", fmt::format("{} is not a multiple of 4", gige.packet_size));
    if (gige.enabled && gige.interface.empty())
        refuse("gige", "interface", "empty, the name or an IPv4 address of a network interface is wanted");
    if (config.v4l2.enabled && config.v4l2.device.find('/') != 0)
        refuse("v4l2", "device", "the absolute path of a video node is wanted, as in /dev/video10");
    const StimulatorSection& stimulator = config.stimulator;
    if (stimulator.grey != "equal" && stimulator.format != "RGB888" && stimulator.format != "XRGB8888")
        refuse("stimulator", "grey",
               fmt::format("\"{}\" needs a format with colours, RGB888 or XRGB8888", stimulator.grey));
    const double white =
        stimulator.white_dn > 0 ? stimulator.white_dn : std::exp2(config.sensor.detector.adc_bits) - 1;
    if (stimulator.black_dn >= white)
        refuse("stimulator", "black_dn",
               fmt::format("{} is not below white at {}", stimulator.black_dn, white));
    if (stimulator.enabled && !stimulator.calibration.empty() &&
        !std::filesystem::is_regular_file(stimulator.calibration))
        refuse("stimulator", "calibration",
               fmt::format("{} is no file that can be read", stimulator.calibration));
}

std::string heading(std::string_view name) {
    return fmt::format("\n[{}]\n", name);
}

} // namespace

Config load(const std::filesystem::path& file) {
    const Value root = parse_file(file);
    const Where top{file, ""};
    read_keys(root, top, {},
              {"daemon", "render", "trigger", "deadline", "camera", "gige", "file", "v4l2", "stimulator",
               "scene", "sensor"});

    Config config;
    config.source = std::filesystem::absolute(file).lexically_normal();
    read_section(root, top, "daemon", config.daemon);
    read_section(root, top, "render", config.render);
    read_section(root, top, "trigger", config.trigger);
    read_section(root, top, "deadline", config.deadline);
    read_section(root, top, "camera", config.camera);
    read_gige(root, top, config.gige);
    read_section(root, top, "file", config.file);
    read_section(root, top, "v4l2", config.v4l2);
    read_section(root, top, "stimulator", config.stimulator);
    if (std::string& table = config.stimulator.calibration; !table.empty())
        table = (config.source.parent_path() / table).lexically_normal().string();
    config.file.directory = (config.source.parent_path() / config.file.directory).lexically_normal().string();

    if (const Member* sensor = root.find("sensor"))
        read_sensor(expect_table(sensor->value, top.in("sensor")), top.in("sensor"), config.sensor, true);

    SceneSection scene;
    const Given given = read_section(root, top, "scene", scene);
    if (given.find("file") == given.end())
        fail(top.in("scene"), position_of(root, "scene", "file"),
             "the key \"file\" is missing, a scene file is wanted");
    check_together(config, root, top);
    config.scene_file = std::filesystem::absolute(scene.file).lexically_normal();
    config.scene = load_scene(scene.file);
    // The chip decides how many pixels there are and how large; the scene file's figures serve `render`.
    config.scene.camera.width = config.sensor.readout.width;
    config.scene.camera.height = config.sensor.readout.height;
    config.scene.camera.pixel_pitch_m = config.sensor.pixel_pitch_m;
    return config;
}

std::string print(const Config& config) {
    Config c = config; // the tables bind to what can be written
    SceneSection scene{c.scene_file.string()};
    std::string out = fmt::format("# Effective configuration of {}\n", printable(c.source.string(), 1000));
    out += heading("scene") + print_keys(keys_of(scene));
    out += heading("daemon") + print_keys(keys_of(c.daemon));
    out += heading("render") + print_keys(keys_of(c.render));
    out += heading("trigger") + print_keys(keys_of(c.trigger));
    out += heading("deadline") + print_keys(keys_of(c.deadline));
    out += heading("camera") + print_keys(keys_of(c.camera));
    out += heading("gige") + print_keys(keys_of(c.gige));
    for (FaultSection& fault : c.gige.faults)
        out += "\n[[gige.faults]]\n" + print_keys(keys_of(fault));
    out += heading("file") + print_keys(keys_of(c.file));
    out += heading("v4l2") + print_keys(keys_of(c.v4l2));
    out += heading("stimulator") + print_keys(keys_of(c.stimulator));
    out += heading("sensor") + print_keys(keys_of(c.sensor));
    out += heading("sensor.readout") + print_keys(keys_of(c.sensor.readout));
    out += heading("sensor.detector") + print_keys(keys_of(c.sensor.detector));
    return out;
}

CameraSettings camera_settings(const Config& config) {
    const CameraSection& camera = config.camera;
    const ReadoutSettings& readout = config.sensor.readout;
    CameraSettings settings;
    settings.region.x = camera.offset_x;
    settings.region.y = camera.offset_y;
    settings.region.width = camera.width == 0 ? readout.width - camera.offset_x : camera.width;
    settings.region.height = camera.height == 0 ? readout.height - camera.offset_y : camera.height;
    for (const auto& [name, format] : {std::pair{"Mono8", PixelFormat::mono8},
                                       {"Mono10", PixelFormat::mono10},
                                       {"Mono12", PixelFormat::mono12},
                                       {"Mono14", PixelFormat::mono14},
                                       {"Mono16", PixelFormat::mono16},
                                       {"Mono10p", PixelFormat::mono10p},
                                       {"Mono12p", PixelFormat::mono12p}})
        if (camera.pixel_format == name) settings.pixel_format = format;
    settings.exposure_ns = std::llround(camera.exposure_us * static_cast<double>(ns_per_us));
    settings.gain_db = camera.gain_db;
    settings.trigger_enabled = camera.trigger_mode == "On";
    settings.trigger_source = camera.trigger_source == "Software"  ? TriggerSource::software
                              : camera.trigger_source == "Action1" ? TriggerSource::action1
                                                                   : TriggerSource::line0;
    settings.frame_rate_hz = camera.frame_rate_hz;
    settings.black_level_dn = config.sensor.detector.offset_dn;
    return settings;
}

} // namespace obscura::config
