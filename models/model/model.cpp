// SPDX-License-Identifier: Apache-2.0
#include "models/model/model.hpp"

#include "core/error.hpp"
#include "core/io/text_file.hpp"
#include "core/text/number.hpp"
#include "core/text/printable.hpp"
#include "core/text/text.hpp"
#include "models/language/parser.hpp"
#include "models/lowering/lowering.hpp"
#include "models/model/entry_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <optional>
#include <utility>

namespace obscura::models {
namespace {

/// Splits "unit, min..max, help" behind a parameter. Each part may be missing.
void read_remark(std::string_view remark, Parameter& p) {
    const auto take = [&] {
        const std::size_t comma = remark.find(',');
        const std::string_view part = trimmed(remark.substr(0, comma));
        remark = comma == std::string_view::npos ? "" : remark.substr(comma + 1);
        return part;
    };
    const auto range_in = [&](std::string_view part) {
        const std::size_t dots = part.find("..");
        if (dots == std::string_view::npos) return false;
        const auto min = decimal_number(trimmed(part.substr(0, dots)));
        const auto max = decimal_number(trimmed(part.substr(dots + 2)));
        if (!min || !max || *min > *max) return false;
        p.min = *min;
        p.max = *max;
        return true;
    };
    const std::string_view whole = trimmed(remark);
    const std::string_view first = take();
    if (range_in(first)) {
        p.help = trimmed(remark);
        return;
    }
    // A unit is one word in front of a comma.
    if (first.size() == whole.size() || first.find(' ') != std::string_view::npos) {
        p.help = whole;
        return;
    }
    p.unit = first == "-" ? "" : first;
    const std::string_view before = remark;
    p.help = range_in(take()) ? trimmed(remark) : trimmed(before);
}

/// Properties that mean something to the renderer.
constexpr std::array<std::string_view, 10> known_properties{
    "has_mirror_component", "level_step",      "required_samples", "cube_size", "width", "height",
    "pixel_pitch_um",       "focal_length_mm", "exposure_ms",      "lipschitz"};

} // namespace

std::string title_comment(std::string_view text) {
    if (!text.starts_with("//")) return "";
    return printable(trimmed(text.substr(2, text.find('\n') - 2)), 100);
}

std::shared_ptr<const Model> Model::load(const std::filesystem::path& file) {
    // Messages quote a text: that of a file which is no model stays where it is.
    if (const std::string why = unknown_ending(file.string()); !why.empty())
        throw ConfigError(fmt::format("{}: {}", file.string(), why));
    std::string text;
    if (const std::string why = read_plain_text(file, max_source_bytes, text); !why.empty())
        throw InputError(fmt::format("{}: {}", file.string(), why), errno);
    return parse(file.string(), std::move(text));
}

std::shared_ptr<const Model> Model::parse(std::string name, std::string text) {
    Findings findings;
    std::string file = name;
    std::shared_ptr<const Model> model = read(std::move(name), std::move(text), findings);
    if (model == nullptr) throw ConfigError(findings.text(file, true));
    return model;
}

std::shared_ptr<const Model> Model::read(std::string name, std::string text, Findings& findings) {
    const std::shared_ptr<Model> model(new Model);
    model->name_ = std::move(name);
    model->text_ = std::move(text);
    model->tree_ = models::parse(model->text_, findings);
    model->read_declarations(findings);
    model->check_functions(findings);
    check_entry_points(*model, findings);
    if (findings.has_errors()) return nullptr;
    model->warnings_ = findings.text(model->name_, false);
    return model;
}

const Function* Model::function(std::string_view name) const noexcept {
    const auto at = std::find_if(tree_.functions.begin(), tree_.functions.end(),
                                 [&](const Function& f) { return f.name == name; });
    return at == tree_.functions.end() ? nullptr : &*at;
}

void Model::read_declarations(Findings& findings) {
    for (std::size_t i = 0; i < tree_.declarations.size(); ++i) {
        const Declaration& d = tree_.declarations[i];
        for (std::size_t k = 0; k < i; ++k)
            if (tree_.declarations[k].name == d.name)
                findings.error(d.at, fmt::format("'{}' is declared in line {} already", d.name,
                                                 tree_.declarations[k].at.line));
        if (d.kind == Declaration::Kind::property) {
            properties_.push_back({d.name, d.value.value[0], d.at});
            if (std::find(known_properties.begin(), known_properties.end(), d.name) == known_properties.end())
                findings.warning(
                    d.at, fmt::format("the property '{}' is not known and has no effect", printable(d.name)));
            continue;
        }
        Parameter p;
        p.name = d.name;
        p.type = d.value.type;
        p.global = d.kind == Declaration::Kind::global;
        p.value = d.value.value;
        p.at = d.at;
        read_remark(d.remark, p);
        for (int c = 0; c < components(p.type); ++c) {
            const double value = p.value[static_cast<std::size_t>(c)];
            if (value < p.min || value > p.max)
                findings.error(d.at, fmt::format("the default {} of '{}' lies outside of {}..{}", value,
                                                 p.name, p.min, p.max));
        }
        parameters_.push_back(p);
    }
}

void Model::check_functions(Findings& findings) const {
    const std::vector<Function>& functions = tree_.functions;
    for (std::size_t i = 0; i < functions.size(); ++i) {
        const Function& f = functions[i];
        for (std::size_t k = 0; k < i; ++k)
            if (functions[k].name == f.name)
                findings.error(
                    f.at, fmt::format("'{}' is defined in line {} already", f.name, functions[k].at.line));
        // Each function by itself, so that all mistakes are found, also of functions that are not used.
        Graph graph;
        std::int32_t index = 0;
        std::vector<NamedValue> names;
        const auto placed = [&](Type type) {
            Value value{type, {}};
            value.nodes.fill(-1);
            if (type == Type::texture) value.nodes[0] = 0;
            for (int c = 0; c < components(type); ++c)
                value.nodes[static_cast<std::size_t>(c)] = graph.input(index++);
            return value;
        };
        for (const Parameter& p : parameters_)
            names.push_back({p.name, placed(p.type)});
        if (const ModelKind* const kind = kind_of(*this))
            for (const EntryArgument& constant : kind->constants)
                names.push_back({constant.name, placed(constant.type)});
        Surroundings surroundings;
        surroundings.look_up = [&](std::string_view name, const std::vector<Value>& arguments,
                                   std::string& why) {
            return look_up_stand_in(*this, name, arguments, why, placed);
        };
        Lowering lowering(tree_, graph, findings, std::move(names), surroundings);
        std::vector<Value> arguments;
        for (const Argument& a : f.arguments)
            arguments.push_back(placed(a.type));
        (void)lowering.result_of_call(f, std::move(arguments));
    }
}

} // namespace obscura::models
