#include "emulator/config/daemon_config.hpp"

#include "core/error.hpp"
#include "core/realtime.hpp"
#include "emulator/config/daemon_keys.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "sensors/sensor_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <iterator>

namespace obscura::emulator {
namespace {

/// Path of the scene file inside [scene].
struct SceneSection {
    std::string file;
};

config::Keys keys_of(SceneSection& s) {
    return {config::key("file", config::Path{&s.file}).help("Scene file")};
}

template<typename Section>
config::Given read_section(const config::Value& root, const config::Where& top, std::string_view name,
                           Section& section) {
    const config::Member* member = root.find(name);
    if (member == nullptr) return {};
    const config::Where where = top.in(name);
    return read_keys(expect_table(member->value, where), where, keys_of(section));
}

/// Position of `key` in `section`, or of the section, or nothing.
config::Position position_of(const config::Value& root, std::string_view section, std::string_view key) {
    const config::Member* table = root.find(section);
    if (table == nullptr) return {};
    const config::Member* member = table->value.find(key);
    return member == nullptr ? table->at : member->value.at;
}

void read_faults(const config::Member& member, const config::Where& where,
                 std::vector<FaultSection>& faults) {
    const std::vector<config::Value>& tables = expect_tables(member, where);
    faults.clear();
    for (std::size_t i = 0; i < tables.size(); ++i) {
        FaultSection fault;
        const config::Where here{where.file, fmt::format("{}[{}]", where.path, i)};
        const config::Given given = read_keys(tables[i], here, keys_of(fault));
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
void read_gige(const config::Value& root, const config::Where& top, GigeSection& gige) {
    const config::Member* member = root.find("gige");
    if (member == nullptr) return;
    const config::Where where = top.in("gige");
    const config::Value& table = expect_table(member->value, where);
    read_keys(table, where, keys_of(gige), {"faults"});
    if (const config::Member* faults = table.find("faults"))
        read_faults(*faults, where.in("faults"), gige.faults);
}

constexpr std::array<std::string_view, line_count - 1> more_lines{"line1", "line2", "line3"};

/// [trigger] of `root` with its further lines.
void read_trigger(const config::Value& root, const config::Where& top, TriggerSection& trigger) {
    const config::Member* member = root.find("trigger");
    if (member == nullptr) return;
    const config::Where where = top.in("trigger");
    const config::Value& table = expect_table(member->value, where);
    read_keys(table, where, keys_of(trigger), {more_lines.begin(), more_lines.end()});
    for (std::size_t i = 0; i < more_lines.size(); ++i)
        read_section(table, where, more_lines[i], trigger.more_lines[i]);
}

/// What a configuration is read from: a file, or a [[camera]] of it laid over the rest of the file.
struct Tables {
    config::Value root;
    config::Where top;    ///< of all tables but
    config::Where camera; ///< the keys of the camera itself

    [[nodiscard]] config::Where where(std::string_view section) const {
        return section == "camera" ? camera : top.in(section);
    }
    [[noreturn]] void refuse(std::string_view section, std::string_view key, std::string_view what) const {
        fail(where(section).in(key), position_of(root, section, key), what);
    }
};

void read_camera(const Tables& tables, CameraSection& camera) {
    const config::Member* section = tables.root.find("camera");
    if (section == nullptr) return;
    const config::Where& where = tables.camera;
    const config::Value& table = expect_table(section->value, where);
    read_keys(table, where, keys_of(camera), {"window"});
    const config::Member* windows = table.find("window");
    if (windows == nullptr) return;
    for (const config::Value& value : expect_tables(*windows, where.in("window"))) {
        const config::Where place = where.in(fmt::format("window[{}]", camera.windows.size()));
        WindowSection& window = camera.windows.emplace_back();
        window.exposure_us = camera.exposure_us;
        const config::Given given = read_keys(value, place, keys_of(window));
        for (const std::string_view key : {"width", "height"})
            if (given.find(key) == given.end())
                fail(place, value.at, fmt::format("the key \"{}\" is missing", key));
    }
    if (camera.windows.empty()) fail(where.in("window"), windows->at, "empty, at least one window is wanted");
}

bool is_mac(const std::string& text) {
    if (text.size() != 17) return false;
    for (std::size_t i = 0; i < text.size(); ++i)
        if (i % 3 == 2 ? text[i] != ':' : std::isxdigit(static_cast<unsigned char>(text[i])) == 0)
            return false;
    // The lowest bit of the first byte is for groups.
    return std::strtol(text.substr(0, 2).c_str(), nullptr, 16) % 2 == 0 && text != "00:00:00:00:00:00";
}

Sampling sampling_of(const WindowSection& window) {
    return window.sampling == "cds"               ? Sampling::cds
           : window.sampling == "ramp"            ? Sampling::ramp
           : window.sampling == "non-destructive" ? Sampling::non_destructive
                                                  : Sampling::destructive;
}

/// Why the sensor cannot have the window: the key and the reason; nothing when it can. Windows that share
/// rows are no reason: the chip reads them, and tells by flags what came of it.
std::pair<std::string_view, std::string> explain_window(const WindowSection& w,
                                                        const ReadoutSettings& readout) {
    const bool lines = readout.shutter == Shutter::push_broom;
    const bool out_x = w.offset_x >= readout.width || w.width > readout.width - w.offset_x;
    const bool out_y = w.offset_y >= readout.height || (!lines && w.height > readout.height - w.offset_y);
    if (readout.strict && out_x)
        return {"width", fmt::format("columns {} to {} leave the sensor, which is {} px wide", w.offset_x,
                                     w.offset_x + w.width - 1, readout.width)};
    if (readout.strict && out_y)
        return {"height", fmt::format("rows {} to {} leave the sensor, which is {} px high", w.offset_y,
                                      w.offset_y + w.height - 1, readout.height)};
    if (w.offset_x >= readout.width || w.offset_y >= readout.height)
        return {w.offset_x >= readout.width ? "offset_x" : "offset_y",
                fmt::format("nothing of the window lies on the sensor, which has {} x {} px", readout.width,
                            readout.height)};
    for (const auto& [key, offset] : {std::pair{"offset_x", w.offset_x}, {"offset_y", w.offset_y}})
        if (readout.strict && offset % readout.window_step != 0)
            return {key, fmt::format("{} is not a multiple of {}, the step of this sensor's windows", offset,
                                     readout.window_step)};
    const Sampling sampling = sampling_of(w);
    if (sampling != Sampling::destructive && readout.shutter != Shutter::rolling)
        return {"sampling", fmt::format("\"{}\" needs a rolling shutter", w.sampling)};
    if (sampling == Sampling::destructive && w.reads != 1)
        return {"reads", fmt::format("{}, a destructive window is read once", w.reads)};
    if ((sampling == Sampling::cds || sampling == Sampling::ramp) && w.reads < 2)
        return {"reads", fmt::format("{}, \"{}\" needs 2 and more", w.reads, w.sampling)};
    return {};
}

void check_windows(const DaemonConfig& config, const Tables& tables) {
    const std::vector<WindowSection>& windows = config.camera.windows;
    if (windows.empty()) return;
    const config::Value& camera = tables.root.find("camera")->value;
    const config::Where& where = tables.camera;
    for (const std::string_view key : {"width", "height", "offset_x", "offset_y"})
        if (const config::Member* member = camera.find(key))
            fail(where.in(key), member->value.at, "not allowed beside [[camera.window]], which says it");
    const config::Member& list = *camera.find("window");
    const std::size_t most =
        std::min(static_cast<std::size_t>(config.sensor.readout.windows_max), max_windows);
    if (windows.size() > most)
        fail(where.in("window"), list.at,
             fmt::format("{} windows, this sensor has at most {}", windows.size(), most));
    std::size_t delivered = 0;
    for (std::size_t i = 0; i < windows.size(); ++i) {
        const auto [key, reason] = explain_window(windows[i], config.sensor.readout);
        const config::Value& table = list.value.items[i];
        const config::Member* member = table.find(key);
        if (!reason.empty())
            fail(where.in(fmt::format("window[{}]", i)).in(key),
                 member == nullptr ? table.at : member->value.at, reason);
        delivered += sampling_of(windows[i]) == Sampling::non_destructive
                         ? static_cast<std::size_t>(windows[i].reads)
                         : std::size_t{1};
    }
    if (delivered > max_windows)
        fail(where.in("window"), list.at,
             fmt::format("{} windows with every non-destructive read counted, allowed are {}", delivered,
                         max_windows));
}

void check_together(const DaemonConfig& config, const Tables& tables) {
    const auto refuse = [&](std::string_view section, std::string_view key, std::string_view what) {
        tables.refuse(section, key, what);
    };
    check_windows(config, tables);
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
    if (!gige.mac.empty() && !is_mac(gige.mac))
        refuse("gige", "mac",
               fmt::format("\"{}\" is no hardware address, allowed six bytes like 02:4f:00:00:00:01",
                           config::printable(gige.mac)));
    if (gige.packet_size % 4 != 0)
        refuse("gige", "packet_size", fmt::format("{} is not a multiple of 4", gige.packet_size));
    if (gige.enabled && gige.interface.empty())
        refuse("gige", "interface", "empty, the name or an IPv4 address of a network interface is wanted");
    if (config.ptp.enabled && (config.ptp.socket.find('/') != 0 || config.ptp.socket.size() > 107))
        refuse("ptp", "socket", "an absolute path of at most 107 characters is wanted, as in /var/run/ptp4l");
    if (config.v4l2.enabled && config.v4l2.device.find('/') != 0)
        refuse("v4l2", "device", "the absolute path of a video node is wanted, as in /dev/video10");
    if (config.trigger.source == "lockstep" && !config.simulator.enabled)
        refuse("trigger", "source", "\"lockstep\" needs simulator.enabled = true");
    if (!config.outputs.exposure.empty() && config.outputs.exposure == config.outputs.trigger_ready)
        refuse("outputs", "exposure", "the same line as trigger_ready");
    ThreadsSection threads = config.threads; // the table binds to what can be written
    for (const config::Key& key : keys_of(threads)) {
        const auto* cores = std::get_if<std::string*>(&key.target);
        if (cores != nullptr && !parse_cores(**cores))
            refuse("threads", key.name, fmt::format("\"{}\" is no list of cores like \"2-3,5\"", **cores));
    }
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

/// The tables that a [[camera]] may have of its own; they are laid over those of the file.
const std::vector<std::string_view> own_tables{"view", "trigger", "deadline", "simulator",  "outputs",
                                               "gige", "file",    "v4l2",     "stimulator", "sensor"};

config::Value laid_over(const config::Value& under, const config::Value& over) {
    config::Value result = under;
    result.at = over.at;
    for (const config::Member& member : over.members) {
        const auto same = std::find_if(result.members.begin(), result.members.end(),
                                       [&](const config::Member& m) { return m.key == member.key; });
        if (same == result.members.end())
            result.members.push_back(member);
        else if (same->value.kind == config::Value::Kind::table &&
                 member.value.kind == config::Value::Kind::table)
            same->value = laid_over(same->value, member.value);
        else
            *same = member;
    }
    return result;
}

/// `element` of [[camera]] as if it alone were in the file.
Tables tables_of_camera(const config::Value& root, const config::Where& top, const config::Value& element,
                        const config::Where& where) {
    CameraSection unused;
    std::vector<std::string_view> tables = own_tables;
    tables.push_back("window");
    read_keys(element, where, keys_of(unused), tables);
    config::Value own, camera;
    own.at = camera.at = element.at;
    for (const config::Member& member : element.members) {
        const bool table = std::find(own_tables.begin(), own_tables.end(), member.key) != own_tables.end();
        if (table) expect_table(member.value, where.in(member.key));
        (table ? own : camera).members.push_back(member);
    }
    own.members.push_back({"camera", element.at, camera});
    config::Value rest = root;
    rest.members.erase(std::remove_if(rest.members.begin(), rest.members.end(),
                                      [](const config::Member& m) { return m.key == "camera"; }),
                       rest.members.end());
    return {laid_over(rest, own), {top.file, where.path}, where};
}

/// Everything but the scene.
DaemonConfig read_config(const Tables& tables) {
    const config::Value& root = tables.root;
    const config::Where& top = tables.top;
    DaemonConfig config;
    config.source = std::filesystem::absolute(top.file).lexically_normal();
    read_section(root, top, "daemon", config.daemon);
    read_section(root, top, "render", config.render);
    read_trigger(root, top, config.trigger);
    read_section(root, top, "ptp", config.ptp);
    read_section(root, top, "deadline", config.deadline);
    read_section(root, top, "threads", config.threads);
    read_section(root, top, "simulator", config.simulator);
    read_section(root, top, "outputs", config.outputs);
    read_camera(tables, config.camera);
    read_gige(root, top, config.gige);
    read_section(root, top, "file", config.file);
    read_section(root, top, "v4l2", config.v4l2);
    read_section(root, top, "stimulator", config.stimulator);
    if (std::string& table = config.stimulator.calibration; !table.empty())
        table = (config.source.parent_path() / table).lexically_normal().string();
    config.file.directory = (config.source.parent_path() / config.file.directory).lexically_normal().string();

    if (const config::Member* sensor = root.find("sensor"))
        sensors::read_sensor(expect_table(sensor->value, top.in("sensor")), top.in("sensor"), config.sensor,
                             true);

    SceneSection scene;
    const config::Given given = read_section(root, top, "scene", scene);
    if (given.find("file") == given.end())
        fail(top.in("scene"), position_of(root, "scene", "file"),
             "the key \"file\" is missing, a scene file is wanted");
    check_together(config, tables);
    config.scene_file = std::filesystem::absolute(scene.file).lexically_normal();
    return config;
}

void put_into_scene(DaemonConfig& config, const scene::Scene& scene, const Tables& tables) {
    config.scene = scene;
    if (const config::Member* view = tables.root.find("view"))
        config.view = scene::read_view(view->value, tables.top.in("view"), config.scene.camera);
    // The chip decides how many pixels there are and how large; the scene file's figures serve `render`.
    config.scene.camera.width = config.sensor.readout.width;
    config.scene.camera.height = config.sensor.readout.height;
    config.scene.camera.pixel_pitch_m = config.sensor.pixel_pitch_m;
}

/// Cameras that would get in each other's way.
void check_apart(const DaemonConfig& a, const DaemonConfig& b, const config::Where& where_a,
                 const Tables& tables_b) {
    const auto refuse = [&](std::string_view section, std::string_view key, const std::string& value,
                            std::string_view what) {
        tables_b.refuse(section, key,
                        fmt::format("\"{}\" is the {} of {}, too; each camera needs its own",
                                    config::printable(value), what, where_a.path));
    };
    if (a.gige.enabled && b.gige.enabled) {
        if (a.gige.interface == b.gige.interface && a.gige.port == b.gige.port)
            refuse("gige", "interface", b.gige.interface, "address");
        if (a.gige.serial == b.gige.serial) refuse("gige", "serial", b.gige.serial, "serial number");
        if (!b.gige.mac.empty() && a.gige.mac == b.gige.mac)
            refuse("gige", "mac", b.gige.mac, "hardware address");
        if (!b.gige.state_file.empty() && a.gige.state_file == b.gige.state_file)
            refuse("gige", "state_file", b.gige.state_file, "file for user sets");
    }
    if (a.file.enabled && b.file.enabled && a.file.directory == b.file.directory)
        refuse("file", "directory", b.file.directory, "folder");
    if (a.v4l2.enabled && b.v4l2.enabled && a.v4l2.device == b.v4l2.device)
        refuse("v4l2", "device", b.v4l2.device, "video node");
    if (a.stimulator.enabled && b.stimulator.enabled && a.stimulator.serial == b.stimulator.serial)
        refuse("stimulator", "serial", b.stimulator.serial, "stimulator");
}

constexpr std::size_t max_cameras = 16;

/// [[camera]]: the first of them, with the others in it.
DaemonConfig load_several(const config::Value& root, const config::Where& top, const config::Member& list) {
    const std::vector<config::Value>& elements = expect_tables(list, top.in("camera"));
    if (elements.empty() || elements.size() > max_cameras)
        fail(top.in("camera"), list.at,
             fmt::format("{} cameras, allowed 1 to {}", elements.size(), max_cameras));
    // The tables they share have to be right by themselves, and are complained of under their own names.
    Tables shared{root, top, top.in("camera")};
    shared.root.members.erase(std::remove_if(shared.root.members.begin(), shared.root.members.end(),
                                             [](const config::Member& m) { return m.key == "camera"; }),
                              shared.root.members.end());
    const DaemonConfig common = read_config(shared);

    std::vector<Tables> tables;
    std::vector<DaemonConfig> cameras;
    for (std::size_t i = 0; i < elements.size(); ++i) {
        tables.push_back(tables_of_camera(root, top, elements[i], top.in(fmt::format("camera[{}]", i))));
        cameras.push_back(read_config(tables[i]));
        cameras[i].several = true;
        cameras[i].own_trigger = elements[i].find("trigger") != nullptr;
        for (std::size_t before = 0; before < i; ++before)
            check_apart(cameras[before], cameras[i], tables[before].camera, tables[i]);
    }
    const scene::Scene scene = scene::load_scene(common.scene_file);
    for (std::size_t i = 0; i < cameras.size(); ++i)
        put_into_scene(cameras[i], scene, tables[i]);
    DaemonConfig first = std::move(cameras[0]);
    first.others.assign(std::make_move_iterator(cameras.begin() + 1), std::make_move_iterator(cameras.end()));
    return first;
}

std::string heading(std::string_view prefix, std::string_view name) {
    return fmt::format("\n[{}{}]\n", prefix, name);
}

/// [trigger] and those of its further lines that something is wired to.
std::string print_trigger(TriggerSection& trigger, std::string_view prefix) {
    std::string out = heading(prefix, "trigger") + print_keys(keys_of(trigger));
    for (std::size_t i = 0; i < more_lines.size(); ++i)
        if (LineSection& line = trigger.more_lines[i]; line.source != "none")
            out += heading(prefix, fmt::format("trigger.{}", more_lines[i])) + print_keys(keys_of(line));
    return out;
}

/// All that a [[camera]] may have of its own but its own keys, view and trigger.
std::string print_own_tables(DaemonConfig& c, std::string_view prefix) {
    std::string out = heading(prefix, "simulator") + print_keys(keys_of(c.simulator));
    out += heading(prefix, "outputs") + print_keys(keys_of(c.outputs));
    out += heading(prefix, "gige") + print_keys(keys_of(c.gige));
    for (FaultSection& fault : c.gige.faults)
        out += fmt::format("\n[[{}gige.faults]]\n", prefix) + print_keys(keys_of(fault));
    out += heading(prefix, "file") + print_keys(keys_of(c.file));
    out += heading(prefix, "v4l2") + print_keys(keys_of(c.v4l2));
    out += heading(prefix, "stimulator") + print_keys(keys_of(c.stimulator));
    out += heading(prefix, "sensor") + print_keys(sensors::keys_of(c.sensor));
    out += heading(prefix, "sensor.readout") + print_keys(sensors::keys_of(c.sensor.readout));
    out += heading(prefix, "sensor.detector") + print_keys(sensors::keys_of(c.sensor.detector));
    return out;
}

/// The camera's own keys and its windows.
std::string print_camera_keys(CameraSection& camera) {
    config::Keys keys = keys_of(camera);
    if (!camera.windows.empty()) // which say these
        keys.erase(std::remove_if(keys.begin(), keys.end(),
                                  [](const config::Key& key) {
                                      return key.name == "width" || key.name == "height" ||
                                             key.name == "offset_x" || key.name == "offset_y";
                                  }),
                   keys.end());
    std::string out = print_keys(keys);
    for (WindowSection& window : camera.windows)
        out += "\n[[camera.window]]\n" + print_keys(keys_of(window));
    return out;
}

std::string print_camera(DaemonConfig& c) {
    std::string out = "\n[[camera]]\n" + print_camera_keys(c.camera);
    if (!c.view.empty()) out += heading("camera.", "view") + c.view;
    if (c.own_trigger) out += print_trigger(c.trigger, "camera.");
    out += heading("camera.", "deadline") + print_keys(keys_of(c.deadline));
    return out + print_own_tables(c, "camera.");
}

TriggerSource trigger_source(const CameraSection& camera) {
    if (camera.trigger_source == "Software") return TriggerSource::software;
    if (camera.trigger_source == "Action1") return TriggerSource::action1;
    return source_of_line(static_cast<std::size_t>(camera.trigger_source.back() - '0'));
}

} // namespace

std::vector<const DaemonConfig*> DaemonConfig::cameras() const {
    std::vector<const DaemonConfig*> all{this};
    for (const DaemonConfig& other : others)
        all.push_back(&other);
    return all;
}

DaemonConfig load_config(const std::filesystem::path& file) {
    const config::Value root = config::parse_file(file);
    const config::Where top{file, ""};
    read_keys(root, top, {},
              {"daemon", "render", "trigger", "ptp", "deadline", "threads", "simulator", "outputs", "camera",
               "gige", "file", "v4l2", "stimulator", "scene", "sensor"});
    if (const config::Member* camera = root.find("camera");
        camera != nullptr && camera->value.kind == config::Value::Kind::array)
        return load_several(root, top, *camera);
    const Tables tables{root, top, top.in("camera")};
    DaemonConfig config = read_config(tables);
    put_into_scene(config, scene::load_scene(config.scene_file), tables);
    return config;
}

std::string print_config(const DaemonConfig& config) {
    DaemonConfig c = config; // the tables bind to what can be written
    SceneSection scene{c.scene_file.string()};
    std::string out =
        fmt::format("# Effective configuration of {}\n", config::printable(c.source.string(), 1000));
    out += heading("", "scene") + print_keys(keys_of(scene));
    out += heading("", "daemon") + print_keys(keys_of(c.daemon));
    out += heading("", "render") + print_keys(keys_of(c.render));
    out += heading("", "ptp") + print_keys(keys_of(c.ptp));
    out += heading("", "threads") + print_keys(keys_of(c.threads));
    if (c.several) {
        std::vector<DaemonConfig*> cameras{&c};
        for (DaemonConfig& other : c.others)
            cameras.push_back(&other);
        const auto shares = [](const DaemonConfig* camera) { return !camera->own_trigger; };
        if (const auto one = std::find_if(cameras.begin(), cameras.end(), shares); one != cameras.end())
            out += print_trigger((*one)->trigger, "");
        for (DaemonConfig* camera : cameras)
            out += print_camera(*camera);
        return out;
    }
    out += print_trigger(c.trigger, "");
    out += heading("", "deadline") + print_keys(keys_of(c.deadline));
    out += heading("", "camera") + print_camera_keys(c.camera);
    return out + print_own_tables(c, "");
}

CameraSettings camera_settings(const DaemonConfig& config) {
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
    const auto from_us = [](double us) { return std::llround(us * static_cast<double>(ns_per_us)); };
    settings.exposure_ns = from_us(camera.exposure_us);
    if (!camera.windows.empty()) {
        std::vector<CameraWindow> windows;
        for (const WindowSection& w : camera.windows)
            windows.push_back({{w.offset_x, w.offset_y, w.width, w.height},
                               from_us(w.exposure_us),
                               sampling_of(w),
                               w.reads});
        settings.set_windows(windows);
    }
    settings.gain_db = camera.gain_db;
    settings.frame_trigger.enabled = camera.trigger_mode == "On";
    settings.frame_trigger.source = trigger_source(camera);
    settings.exposure_mode =
        camera.exposure_mode == "TriggerWidth" ? ExposureMode::trigger_width : ExposureMode::timed;
    settings.frame_rate_hz = camera.frame_rate_hz;
    settings.black_level_dn = config.sensor.detector.offset_dn;
    return settings;
}

} // namespace obscura::emulator
