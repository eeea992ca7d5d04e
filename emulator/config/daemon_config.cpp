// SPDX-License-Identifier: Apache-2.0
#include "emulator/config/daemon_config.hpp"

#include "config/shipped_files.hpp"
#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "core/text/printable.hpp"
#include "core/text/suggestion.hpp"
#include "emulator/config/initial_camera.hpp"
#include "emulator/config/model_use.hpp"
#include "renderer/scene/scene_tree.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "sensors/sensor_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>

namespace obscura::emulator {
namespace {

constexpr std::size_t max_cameras = 16;

config::Section scene_section(std::string& scene_file) {
    config::Section section;
    section.name = "scene";
    section.help = "The scene that the cameras see.";
    section.keys = {config::key("file", config::Path{&scene_file, false})
                        .reloadable()
                        .help("Scene file, or the name of a shipped scene (\"demo\")")};
    section.check = [&scene_file](const config::ReadTable& table) {
        if (!table.has("file"))
            table.refuse_table("the key \"file\" is missing, a scene file is wanted");
        else if (!scene_file.empty())
            table.mistakes().collect([&] {
                const config::Value& value = table.table()->find("file")->value;
                const std::string given = std::exchange(scene_file, {});
                const std::string file =
                    config::file_of_key(value, table.where().in("file"), given, config::shipped_scenes);
                scene_file = absolute_path(file).string();
            });
    };
    return section;
}

/// Tables that a configuration is read from: those of a file, or those of a [[camera]] of it laid over the
/// rest of the file.
struct Tables {
    config::Value root;
    config::Where top;    ///< of all tables but [camera]
    config::Where camera; ///< of the keys of the camera itself

    /// `section` under its name in the file: "gige", or "camera[1].gige".
    [[nodiscard]] config::ReadTable table(std::string_view section, config::Mistakes& mistakes) const {
        const config::ReadTable found = table_for_checks(root, top, section, mistakes);
        return section != "camera" ? found
                                   : config::ReadTable(found.table(), found.at(), camera, {}, mistakes);
    }
};

/// Refuses `key` of [sensor.detector]; named is `file` of [sensor] if the value comes from there.
void refuse_detector(std::string_view key, std::string_view what, const Tables& tables,
                     config::Mistakes& mistakes) {
    const config::ReadTable sensor = tables.table("sensor", mistakes);
    const config::Member* detector = sensor.table() == nullptr ? nullptr : sensor.table()->find("detector");
    const bool here = detector != nullptr &&
                      (detector->value.find(key) != nullptr || detector->value.find("adc_bits") != nullptr);
    if (here)
        table_for_checks(*sensor.table(), sensor.where(), "detector", mistakes).refuse(key, what);
    else
        sensor.refuse("file", what);
}

/// Checks the settings of the camera after reset against its limits and transports. The sections are valid by
/// themselves.
void check_initial_camera(const DaemonConfig& config, const Tables& tables, config::Mistakes& mistakes) {
    const InitialCamera camera = initial_camera(config);
    if (const auto invalid = find_invalid(camera.settings, camera.limits)) {
        const config::ReadTable table = tables.table("camera", mistakes);
        const std::string_view key = key_of_feature(invalid->feature, !config.camera.windows.empty());
        if (invalid->feature == "BlackLevel")
            refuse_detector("offset_dn", invalid->what, tables, mistakes);
        else if (key.empty())
            table.refuse_table(invalid->what);
        else
            table.refuse(key, invalid->what);
        return;
    }
    const transports::SensorFacts sensor{config.sensor.readout.width, config.sensor.readout.height,
                                         config.sensor.detector.adc_bits};
    config.transports.check_with({sensor, camera.limits, camera.settings}, tables.root, tables.top, mistakes);
}

/// Checks rules between sections.
void check_together(const DaemonConfig& config, const Tables& tables, config::Mistakes& mistakes) {
    const std::size_t before = mistakes.count();
    check_camera(config.camera, config.sensor.readout, tables.table("camera", mistakes));
    const bool good_camera = mistakes.count() == before;
    if (config.trigger.lines[0].source == "lockstep" && !config.simulator.enabled)
        tables.table("trigger", mistakes).refuse("source", "\"lockstep\" needs simulator.enabled = true");
    if (good_camera) check_initial_camera(config, tables, mistakes);
}

/// The tables that a [[camera]] may have of its own; they are laid over those of the file.
std::vector<std::string_view> own_tables() {
    DaemonConfig unused;
    std::vector<std::string_view> names{"view"};
    for (const config::Section& section : camera_sections(unused))
        if (section.name != "camera") names.push_back(section.name);
    return names;
}

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

config::Value without_cameras(config::Value root) {
    root.members.erase(std::remove_if(root.members.begin(), root.members.end(),
                                      [](const config::Member& m) { return m.key == "camera"; }),
                       root.members.end());
    return root;
}

/// The tables of `element` of [[camera]], as if the file had this camera only.
Tables tables_of_camera(const config::Value& root, const config::Where& top, const config::Value& element,
                        const config::Where& where) {
    const std::vector<std::string_view> own_names = own_tables();
    config::Value own, camera;
    own.at = camera.at = element.at;
    for (const config::Member& member : element.members) {
        const bool table = std::find(own_names.begin(), own_names.end(), member.key) != own_names.end();
        (table ? own : camera).members.push_back(member);
    }
    own.members.push_back({"camera", element.at, camera});
    return {laid_over(without_cameras(root), own), {top.file, where.path}, where};
}

/// Notes where the values stand that the tables have, and those of the sensor file that they name. `path` is
/// the dotted path of the camera's tables.
void note_sources_of(const Tables& tables, const std::string& path, DaemonConfig& config) {
    const std::string prefix = path.empty() ? path : path + ".";
    const config::Member* const sensor = tables.root.find("sensor");
    const config::Member* const file = sensor == nullptr ? nullptr : sensor->value.find("file");
    if (file != nullptr) {
        const std::string named = (config.source.parent_path() / file->value.string).string();
        const std::string sensor_file =
            config::file_of_key(file->value, tables.top.in("sensor.file"), named, config::shipped_sensors);
        note_sources(config::parse_file(sensor_file), prefix + "sensor", sensor_file, config.sources);
    }
    for (const config::Member& member : tables.root.members) {
        const bool camera = !path.empty() && member.key == "camera";
        if (camera) {
            note_sources(member.value, path, config.source, config.sources);
            continue;
        }
        config::Value one;
        one.members.push_back(member);
        note_sources(one, path, config.source, config.sources);
    }
}

/// Reads all sections; not the scene file.
DaemonConfig read_config(const Tables& tables, bool several, config::Mistakes& mistakes) {
    DaemonConfig config;
    config.source = absolute_path(tables.top.file);
    const std::size_t before = mistakes.count();
    config::Section whole = root_section(config);
    std::optional<models::UseModels> use;
    for (config::Section& section : whole.tables) {
        // The sensor has models; [models] and [threads] have been read before.
        if (section.name == "sensor") use.emplace(model_use(config));
        // The names of the tables beside its keys are for the suggestion.
        if (several && section.name == "camera") section.elsewhere = own_tables();
        const config::ReadTable table = tables.table(section.name, mistakes);
        read_section(table.table(), table.at(), table.where(), section, mistakes);
    }
    if (mistakes.count() == before) check_together(config, tables, mistakes);
    if (mistakes.count() == before)
        mistakes.collect([&] { note_sources_of(tables, several ? tables.camera.path : "", config); });
    return config;
}

/// The sensor determines number and size of the pixels; those of the scene file serve `obscura render`.
void take_pixels_of_sensor(DaemonConfig& config) {
    config.scene.camera.width = config.sensor.readout.width;
    config.scene.camera.height = config.sensor.readout.height;
    config.scene.camera.pixel_pitch_m = config.sensor.pixel_pitch_m;
    config.scene.camera.pixel_pitch_y_m = config.sensor.pixel_pitch_y_m;
}

void put_into_scene(DaemonConfig& config, const scene::Scene& scene, const Tables& tables,
                    config::Mistakes& mistakes) {
    config.scene = scene;
    if (config.daemon.scene_time == SceneTime::tai && !scene.epoch)
        table_for_checks(tables.root, {tables.top.file, ""}, "daemon", mistakes)
            .refuse("scene_time", "\"tai\" needs an epoch in the scene file");
    if (const config::Member* view = tables.root.find("view")) {
        mistakes.collect(
            [&] { config.view = scene::read_view(view->value, tables.top.in("view"), config.scene); });
        const config::Member* look_at = view->value.find("look_at");
        const std::string why = scene::explain_missing_target(config.scene, config.scene.camera.motion);
        if (look_at != nullptr && !why.empty())
            mistakes.add(tables.top.in("view").in("look_at"), look_at->value.at, why);
    }
    take_pixels_of_sensor(config);
}

/// Reads the scene file that the configuration names, if any. Returns an empty scene if it has mistakes,
/// which are added.
scene::Scene read_scene(const DaemonConfig& config, config::Mistakes& mistakes) {
    scene::Scene scene;
    if (config.scene_file.empty()) return scene;
    const models::UseModels models(model_use(config));
    mistakes.collect([&] { scene = scene::load_scene(config.scene_file); });
    return scene;
}

/// Reads all cameras of [[camera]]. Returns the first one, which contains the others.
DaemonConfig read_several(const config::Value& root, const config::Where& top, const config::Member& list,
                          config::Mistakes& mistakes) {
    const std::vector<config::Value>& elements = expect_tables(list, top.in("camera"));
    if (elements.empty() || elements.size() > max_cameras)
        fail(top.in("camera"), list.at,
             fmt::format("{} cameras, allowed 1 to {}", elements.size(), max_cameras));
    // The shared tables must be valid by themselves, and are refused under their own names.
    const DaemonConfig common = read_config({without_cameras(root), top, top.in("camera")}, false, mistakes);
    const scene::Scene scene = read_scene(common, mistakes);
    // Mistakes in the shared tables would be repeated for each camera.
    mistakes.throw_if_any();

    std::vector<Tables> tables;
    std::vector<DaemonConfig> cameras;
    for (std::size_t i = 0; i < elements.size(); ++i) {
        tables.push_back(tables_of_camera(root, top, elements[i], top.in(fmt::format("camera[{}]", i))));
        cameras.push_back(read_config(tables[i], true, mistakes));
        cameras[i].several = true;
        // Cameras with one seed and run word would share their temporal noise.
        if (std::int64_t& run = cameras[i].daemon.run; run >= 0)
            run = (run + static_cast<std::int64_t>(i)) % (std::int64_t{1} << 32);
        cameras[i].own_trigger = elements[i].find("trigger") != nullptr;
        for (std::size_t before = 0; before < i && mistakes.count() == 0; ++before)
            cameras[i].transports.check_apart(cameras[before].transports, tables[before].camera.path,
                                              tables[i].root, tables[i].top, mistakes);
        put_into_scene(cameras[i], scene, tables[i], mistakes);
    }
    config::Sources sources = common.sources;
    for (DaemonConfig& camera : cameras)
        sources.merge(camera.sources);
    DaemonConfig first = std::move(cameras[0]);
    first.sources = std::move(sources);
    first.others.assign(std::make_move_iterator(cameras.begin() + 1), std::make_move_iterator(cameras.end()));
    return first;
}

/// Prints one [[camera]] with its own tables.
std::string print_camera(DaemonConfig& c) {
    std::string out;
    for (config::Section& section : camera_sections(c)) {
        if (section.name == "trigger" && !c.own_trigger) continue;
        if (section.name != "camera") {
            out += print_section(section, "camera.");
            continue;
        }
        // Keys and windows of [[camera]] come first: TOML requires them before the tables.
        out = fmt::format("\n[[camera]]{}",
                          print_section(section, "").substr(std::string("\n[camera]").size())) +
              (c.view.empty() ? "" : "\n[camera.view]\n" + c.view) + out;
    }
    return out;
}

} // namespace

std::vector<config::Section> shared_sections(DaemonConfig& c) {
    return {scene_section(c.scene_file), section_of(c.daemon),  section_of(c.render), section_of(c.ptp),
            section_of(c.threads),       section_of(c.monitor), section_of(c.models), section_of(c.control)};
}

std::vector<config::Section> camera_sections(DaemonConfig& c) {
    std::vector<config::Section> sections{section_of(c.trigger), section_of(c.deadline), section_of(c.camera),
                                          section_of(c.simulator), section_of(c.outputs)};
    for (config::Section& section : c.transports.sections())
        sections.push_back(std::move(section));
    sections.push_back(sensors::referring_section_of(c.sensor));
    return sections;
}

config::Section root_section(DaemonConfig& c) {
    config::Section root;
    root.tables = shared_sections(c);
    for (config::Section& section : camera_sections(c))
        root.tables.push_back(std::move(section));
    return root;
}

std::vector<const DaemonConfig*> DaemonConfig::cameras() const {
    std::vector<const DaemonConfig*> all{this};
    for (const DaemonConfig& other : others)
        all.push_back(&other);
    return all;
}

DaemonConfig load_config(const std::filesystem::path& file) {
    const config::Value root = config::parse_file(file);
    const config::Where top{file, ""};
    config::Mistakes mistakes;
    DaemonConfig unused;
    std::vector<std::string_view> names;
    const config::Section whole = root_section(unused);
    for (const config::Section& section : whole.tables)
        names.push_back(section.name);
    read_keys(root, top, {}, mistakes, names);
    const config::Member* camera = root.find("camera");
    DaemonConfig config;
    if (camera != nullptr && camera->value.kind == config::Value::Kind::array) {
        mistakes.collect([&] { config = read_several(root, top, *camera, mistakes); });
    } else {
        const Tables tables{root, top, top.in("camera")};
        config = read_config(tables, false, mistakes);
        put_into_scene(config, read_scene(config, mistakes), tables, mistakes);
    }
    mistakes.throw_if_any();
    return config;
}

std::string print_config(const DaemonConfig& config) {
    DaemonConfig c = config; // the sections bind to what can be written
    std::string out = fmt::format("# Effective configuration of {}\n", printable(c.source.string(), 1000));
    for (const config::Section& section : shared_sections(c))
        out += print_section(section, "");
    if (!c.several) {
        for (const config::Section& section : camera_sections(c))
            out += print_section(section, "");
        return out;
    }
    std::vector<DaemonConfig*> cameras{&c};
    for (DaemonConfig& other : c.others)
        cameras.push_back(&other);
    const auto shares = [](const DaemonConfig* camera) { return !camera->own_trigger; };
    if (const auto one = std::find_if(cameras.begin(), cameras.end(), shares); one != cameras.end())
        out += print_section(section_of((*one)->trigger), "");
    for (DaemonConfig* camera : cameras)
        out += print_camera(*camera);
    return out;
}

DaemonConfig with_scene(DaemonConfig config, const std::filesystem::path& scene_file) {
    const std::filesystem::path file = absolute_path(scene_file);
    const models::UseModels models(model_use(config));
    const scene::Scene scene = scene::load_scene(file);
    std::vector<DaemonConfig*> cameras{&config};
    for (DaemonConfig& other : config.others)
        cameras.push_back(&other);
    for (DaemonConfig* camera : cameras) {
        camera->scene = scene;
        if (camera->scene_file != file.string()) camera->sources["scene.file"] = "scene.show";
        camera->scene_file = file.string();
        if (!camera->view.empty()) {
            const config::Value view = config::parse_text(camera->view, camera->source.string());
            (void)scene::read_view(view, {camera->source, "camera.view"}, camera->scene);
        }
        if (camera->daemon.scene_time == SceneTime::tai && !scene.epoch)
            throw ConfigError(fmt::format("{}: daemon.scene_time = \"tai\" needs an epoch in the scene file",
                                          file.string()));
        take_pixels_of_sensor(*camera);
    }
    return config;
}

DaemonConfig with_values(DaemonConfig config, const config::Value& tables, const std::string& by) {
    const config::Where top{by, ""};
    config::Mistakes mistakes;
    std::vector<std::string> paths, known;
    // Another scene is shown by scene.show.
    const auto can_change = [](std::string_view section, const config::Key& key) {
        return key.is_reloadable() && section != "scene";
    };
    const std::vector<config::Section> shared = shared_sections(config);
    const config::Section whole = root_section(config);
    for (const config::Section& section : whole.tables) {
        const bool is_shared = section.name == "trigger" ||
                               std::any_of(shared.begin(), shared.end(), [&](const config::Section& one) {
                                   return one.name == section.name;
                               });
        for (const config::Key& key : section.keys)
            if (can_change(section.name, key) && (is_shared || !config.several))
                known.push_back(fmt::format("{}.{}", section.name, key.name));
    }
    for (const config::Member& table : tables.members) {
        mistakes.collect([&] { (void)expect_table(table.value, top.in(table.key)); });
        for (const config::Member& member : table.value.members) {
            paths.push_back(fmt::format("{}.{}", table.key, member.key));
            if (std::find(known.begin(), known.end(), paths.back()) == known.end())
                mistakes.add(top.in(table.key).in(member.key), member.at,
                             fmt::format("cannot change while the daemon runs, {}",
                                         suggestion(paths.back(), {known.begin(), known.end()})));
        }
    }
    mistakes.throw_if_any();
    std::vector<DaemonConfig*> cameras{&config};
    for (DaemonConfig& other : config.others)
        cameras.push_back(&other);
    for (DaemonConfig* camera : cameras) {
        const config::Section own = root_section(*camera);
        for (const config::Section& section : own.tables) {
            const config::Member* const table = tables.find(section.name);
            if (table == nullptr || (section.name == "trigger" && camera->own_trigger)) continue;
            read_section(&table->value, table->at, top.in(section.name), section, mistakes);
        }
    }
    mistakes.throw_if_any();
    if (!config.several) check_together(config, {tables, top, top.in("camera")}, mistakes);
    mistakes.throw_if_any();
    for (const std::string& path : paths)
        config.sources[path] = by;
    return config;
}

bool is_reloadable(const std::string& path) {
    DaemonConfig unused;
    return config::is_reloadable(root_section(unused), path);
}

CameraSettings camera_settings(const DaemonConfig& config) {
    return camera_settings(config.camera, config.sensor);
}

} // namespace obscura::emulator
