// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/model_examination.hpp"

#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "core/io/temporary_name.hpp"
#include "core/text/printable.hpp"
#include "models/language/token_reader.hpp"
#include "models/lowering/lowering.hpp"
#include "models/model/entry_points.hpp"
#include "models/model/model.hpp"
#include "models/values/model_values.hpp"
#include "renderer/scene/scene_text.hpp"
#include "tools/model/kind_tools.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <system_error>
#include <utility>

namespace obscura::emulator {
namespace {

using nlohmann::json;

json parameters_of(const models::LoadedModel& loaded) {
    json rows = json::array();
    const auto limit = [](double value) { return std::isfinite(value) ? json(value) : json(nullptr); };
    for (std::size_t i = 0; i < loaded.model->parameters().size(); ++i) {
        const models::Parameter& p = loaded.model->parameters()[i];
        json value = json::array();
        if (p.type != models::Type::texture)
            value = std::vector<double>(p.value.begin(), p.value.begin() + models::components(p.type));
        rows.push_back({{"name", p.name},
                        {"key", loaded.keys[i]},
                        {"type", models::name_of(p.type)},
                        {"global", p.global},
                        {"default", std::move(value)},
                        {"unit", printable(p.unit)},
                        {"min", limit(p.min)},
                        {"max", limit(p.max)},
                        {"help", printable(p.help)},
                        {"line", p.at.line}});
    }
    return rows;
}

json cost_of(const tools::ModelCost& cost) {
    json told{{"operations", cost.operations},
              {"values", cost.slots},
              {"native", cost.why_interpreted.empty()},
              {"ns", cost.ns}};
    if (!cost.why_interpreted.empty()) told["why_interpreted"] = cost.why_interpreted;
    return told;
}

/// Lines `NAME:LINE:COLUMN: what` as findings; others stand at the first line.
void add_lines(const std::string& name, std::string_view lines, std::vector<models::Finding>& findings) {
    while (!lines.empty()) {
        std::string_view line = lines.substr(0, lines.find('\n'));
        lines.remove_prefix(std::min(line.size() + 1, lines.size()));
        models::Finding finding;
        if (line.starts_with(name + ":")) {
            line.remove_prefix(name.size() + 1);
            for (int* const number : {&finding.at.line, &finding.at.column}) {
                const auto [end, bad] = std::from_chars(line.data(), line.data() + line.size(), *number);
                if (bad != std::errc{} || end == line.data() + line.size() || *end != ':') break;
                line.remove_prefix(static_cast<std::size_t>(end - line.data()) + 1);
            }
            if (line.starts_with(' ')) line.remove_prefix(1);
        }
        finding.what = printable(line, max_message_bytes);
        findings.push_back(std::move(finding));
    }
}

std::shared_ptr<const models::LoadedModel> loaded_text(const std::string& name, const std::string& text,
                                                       const models::Execution& execution) {
    return models::loaded_model(models::Model::parse(name, text), execution);
}

} // namespace

std::string ModelExamination::first_error(const std::string& name) const {
    for (const models::Finding& finding : findings)
        if (finding.error)
            return fmt::format("{}:{}:{}: {}", name, finding.at.line, finding.at.column, finding.what);
    return {};
}

ModelExamination examine_model(const std::string& name, const std::string& text,
                               const models::Execution& execution) {
    ModelExamination examined;
    models::Findings findings;
    const auto model = models::Model::read(name, text, findings);
    examined.findings = findings.sorted();
    if (model == nullptr) return examined;
    const tools::KindTools& kind = tools::tools_of(*model);
    const auto loaded = models::loaded_model(model, execution);
    examined.parameters = parameters_of(*loaded);
    try {
        const models::ModelValues values = models::defaults_of(loaded);
        const tools::ModelVerdict verdict = kind.check(values);
        examined.cost = cost_of(kind.cost(values));
        if (!verdict.refusal.empty()) examined.findings.push_back({verdict.at, true, verdict.refusal});
        for (const std::string& warning : verdict.warnings)
            examined.findings.push_back({verdict.at, false, warning});
        examined.sound = verdict.refusal.empty();
        examined.summary = examined.sound ? verdict.summary : "";
        for (const auto& [ending, what] : kind.plots)
            examined.plots.emplace_back(ending);
    } catch (const ConfigError& error) {
        add_lines(name, error.what(), examined.findings);
    }
    return examined;
}

json model_words() {
    const auto names = models::keyword_names();
    std::vector<std::string_view> functions = models::built_in_names();
    for (const models::ModelKind& kind : models::model_kinds())
        for (const models::LookUpFunction& look_up : kind.look_ups)
            if (std::find(functions.begin(), functions.end(), look_up.name) == functions.end())
                functions.push_back(look_up.name);
    return {{"keywords", std::vector<std::string_view>(names.begin(), names.end())},
            {"functions", std::move(functions)},
            {"constants", models::built_in_constant_names()}};
}

std::string plot_of(const std::string& name, const std::string& text, const std::string& ending,
                    const models::Execution& execution) {
    const auto loaded = loaded_text(name, text, execution);
    const std::filesystem::path file =
        temporary_beside(temporary_files_folder() / "obscura-model").replace_extension(ending);
    const auto remove = [](const std::filesystem::path* path) {
        std::error_code error;
        std::filesystem::remove(*path, error);
    };
    const std::unique_ptr<const std::filesystem::path, decltype(remove)> removed(&file, remove);
    tools::tools_of(*loaded->model)
        .plot(models::defaults_of(loaded), std::filesystem::path(name).stem().string(), file);
    return scene::text_of_file(file);
}

} // namespace obscura::emulator
