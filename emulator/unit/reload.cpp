// SPDX-License-Identifier: Apache-2.0
#include "emulator/unit/reload.hpp"

#include "config/document.hpp"
#include "core/fnv.hpp"
#include "models/model/entry_points.hpp"
#include "models/values/model_use.hpp"
#include "renderer/scene/scene_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string>

namespace obscura::emulator {
namespace {

using Values = std::map<std::string, std::string>;

std::string scalar_text(const config::Value& value) {
    switch (value.kind) {
    case config::Value::Kind::boolean:
        return value.boolean ? "true" : "false";
    case config::Value::Kind::integer:
        return fmt::format("{}", value.integer);
    case config::Value::Kind::real:
        return fmt::format("{}", value.real);
    default:
        return value.string;
    }
}

// All values by name: "gige.port", "camera[1].gige.faults[0].kind". A list of scalars is one value.
void flatten(const config::Value& value, const std::string& name, Values& values) {
    using Kind = config::Value::Kind;
    if (value.kind == Kind::table) {
        for (const config::Member& member : value.members)
            flatten(member.value, name.empty() ? member.key : name + "." + member.key, values);
    } else if (value.kind == Kind::array) {
        for (std::size_t i = 0; i < value.items.size(); ++i) {
            const Kind kind = value.items[i].kind;
            if (kind == Kind::table || kind == Kind::array)
                flatten(value.items[i], fmt::format("{}[{}]", name, i), values);
            else
                values[name] += scalar_text(value.items[i]) + '\0';
        }
    } else {
        values[name] = scalar_text(value);
    }
}

Values values_of(const emulator::DaemonConfig& config) {
    Values values;
    flatten(config::parse_text(emulator::print_config(config), "effective configuration"), "", values);
    return values;
}

} // namespace

std::vector<std::string> changed_keys(const emulator::DaemonConfig& before,
                                      const emulator::DaemonConfig& after) {
    const auto old_values = values_of(before), new_values = values_of(after);
    std::vector<std::string> changed;
    for (const auto& [key, value] : new_values) {
        const auto old = old_values.find(key);
        if (old == old_values.end() || old->second != value) changed.push_back(key);
    }
    for (const auto& [key, value] : old_values)
        if (new_values.find(key) == new_values.end()) changed.push_back(key);
    return changed;
}

std::string scene_refusal(const scene::Scene& before, const DaemonConfig& next) {
    const scene::Scene& after = next.scene;
    if (!std::equal(before.bands.begin(), before.bands.end(), after.bands.begin(), after.bands.end(),
                    [](const SpectralBand& a, const SpectralBand& b) { return a.same_filter(b); }))
        return "the scene's spectral bands cannot change while running; restart for that";
    if (next.daemon.scene_time == SceneTime::tai && before.epoch != after.epoch)
        return "the scene's epoch cannot change while frames follow it (daemon.scene_time = \"tai\"); restart for that";
    if (next.simulator.enabled) return "the scene cannot change while a simulator moves it; restart for that";
    return {};
}

std::uint64_t scene_fingerprint(const std::filesystem::path& scene_file,
                                const std::filesystem::path& models_folder) {
    const std::string text = scene::text_of_file(scene_file);
    std::uint64_t print = fnv1a(text);
    const auto add = [&print](const std::filesystem::path& file) {
        std::error_code error;
        if (!std::filesystem::is_regular_file(file, error)) return;
        const auto size = std::filesystem::file_size(file, error);
        const auto written = std::filesystem::last_write_time(file, error).time_since_epoch().count();
        print = fnv1a(fmt::format("{} {}", size, written), print);
    };
    // Any quoted text may be a file name.
    for (const std::string& quoted : scene::quoted_texts(text)) {
        add(scene_file.parent_path() / quoted);
        for (const models::ModelKind& kind : models::model_kinds())
            if (const auto model = models::find_model(models_folder, quoted, kind.ending)) add(*model);
    }
    return text.empty() ? 0 : print;
}

} // namespace obscura::emulator
