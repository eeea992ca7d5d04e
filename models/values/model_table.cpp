// SPDX-License-Identifier: Apache-2.0
#include "models/values/model_table.hpp"

#include "core/io/path_state.hpp"
#include "models/values/model_use.hpp"

#include <fmt/format.h>

#include <utility>
#include <vector>

namespace obscura::models {
namespace {

constexpr std::string_view model_name = "model";

} // namespace

config::Key model_key(std::string& file) {
    return config::key(model_name, config::Path{&file, false})
        .required()
        .help("SuMoL file of the model, or the name of a shipped one");
}

std::string model_file(const config::Value& table, const config::Where& where, std::string_view kind) {
    std::vector<std::string_view> others;
    for (const config::Member& member : table.members)
        if (member.key != model_name) others.push_back(member.key);
    std::string file;
    (void)config::read_keys(table, where, {model_key(file)}, others);
    const config::Value& value = table.find(model_name)->value;
    const config::ShippedFolder shipped = shipped_models(kind);
    if (is_file_at(file)) return file;
    if (const auto own = find_model(UseModels::current().folder, value.string, shipped.ending))
        return own->string();
    return config::file_of_key(value, where.in(model_name), file, shipped);
}

bool read_model_table(
    const config::ReadTable& table, std::string_view key, std::string_view kind,
    const std::function<void(const config::Member&, const config::Where&, std::string&)>& read) {
    const config::Member* const member = table.table() == nullptr ? nullptr : table.table()->find(key);
    if (member == nullptr || member->value.kind != config::Value::Kind::table) return false;
    const config::Where where = table.where().in(key);
    (void)table.mistakes().collect([&] {
        std::string file = model_file(member->value, where, kind);
        read(*member, where, file);
    });
    return true;
}

std::optional<ModelValues> read_model(const config::ReadTable& table, std::string_view key,
                                      std::string_view kind) {
    const config::Member* const given = table.table() == nullptr ? nullptr : table.table()->find(key);
    // A word with its provenance.
    if (given != nullptr && given->value.find("value") != nullptr && given->value.find(model_name) == nullptr)
        return {};
    std::optional<ModelValues> read;
    (void)read_model_table(table, key, kind,
                           [&](const config::Member& member, const config::Where& where, std::string& file) {
                               ModelValues p = defaults_of(load_model(file, kind));
                               config::Keys keys = parameter_keys(p, &member.value);
                               keys.push_back(model_key(file));
                               (void)config::read_keys(member.value, where, keys, table.mistakes());
                               read = std::move(p);
                           });
    return read;
}

std::string table_text(const ModelValues& values) {
    if (values.loaded == nullptr) return {};
    ModelValues written = values; // the keys bind to what can be written
    const std::string file = absolute_path(values.loaded->model->name()).string();
    std::string text = fmt::format("{{ {} = {}", model_name, config::toml_string(file));
    for (const config::Key& key : parameter_keys(written))
        text += fmt::format(", {} = {}", key.name, value_text(key));
    return text + " }";
}

} // namespace obscura::models
