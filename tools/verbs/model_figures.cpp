// SPDX-License-Identifier: Apache-2.0
// Verbs `obscura model eval`, `plot` and `bench`: what a model in SuMoL gives, looks like and costs.
#include "core/error.hpp"
#include "core/text/number.hpp"
#include "core/text/printable.hpp"
#include "core/text/suggestion.hpp"
#include "models/model/entry_points.hpp"
#include "tools/model/kind_tools.hpp"
#include "tools/verbs/model.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>
#include <vector>

namespace obscura::tools {
namespace {

/// A model and its parameters on the command line.
struct ModelArguments {
    std::string file;
    std::vector<std::string> settings;

    void declare(host::CommandLine& line) {
        line.positional("MODEL", &file, "File, or name of a shipped model");
        line.option("--set", &settings, "NAME=VALUE",
                    "Value of a parameter instead of its default; may be given several times");
    }
    [[nodiscard]] models::ModelValues model() const { return chosen_model(file, settings); }
    [[nodiscard]] std::string title() const { return std::filesystem::path(file).stem().string(); }
};

/// Throws UsageError for a model whose kind has no `what`.
[[noreturn]] void refuse_kind(const KindTools& tools, std::string_view what) {
    throw host::UsageError(fmt::format("obscura model {}: not for models of kind {}", what, tools.kind));
}

/// Lines for people, or one JSON object.
void print_facts(const ModelFacts& facts, bool as_json) {
    nlohmann::json told = nlohmann::json::object();
    std::size_t width = 0;
    for (const ModelFact& fact : facts)
        width = std::max(width, fact.label.size());
    for (const ModelFact& fact : facts)
        if (as_json)
            told[fact.name] = fact.value;
        else
            fmt::print("{:{}}  {}\n", fact.label, width, fact.text);
    if (as_json) fmt::print("{}\n", told.dump());
}

/// Names, units and ranges of the points of all kinds.
std::string points_help() {
    std::string text;
    for (const KindTools* tools : kind_tools()) {
        if (tools->point.empty()) continue;
        text += fmt::format(" {}:", tools->kind);
        for (const PointArgument& a : tools->point)
            text += fmt::format("{} {} ({}{}{:g} to {:g}, {:g} if not given)",
                                &a == tools->point.data() ? "" : ",", a.name, a.unit,
                                a.unit.empty() ? "" : ", ", a.min, a.max, a.value);
        text += '.';
    }
    return text;
}

ModelPoint read_point(const KindTools& tools, const std::vector<std::string>& given) {
    ModelPoint point;
    std::vector<std::string_view> names;
    for (const PointArgument& a : tools.point) {
        point[std::string(a.name)] = a.value;
        names.push_back(a.name);
    }
    for (const std::string& text : given) {
        const std::size_t sign = text.find('=');
        const std::string name = text.substr(0, sign);
        const auto at = std::find_if(tools.point.begin(), tools.point.end(),
                                     [&](const PointArgument& a) { return a.name == name; });
        if (at == tools.point.end())
            throw host::UsageError(fmt::format("--at {}: {}", printable(text), allowed_words(name, names)));
        const auto value = sign == std::string::npos ? std::nullopt : decimal_number(text.substr(sign + 1));
        if (!value || *value < at->min || *value > at->max)
            throw host::UsageError(
                fmt::format("--at {}: allowed is {}={:g} to {:g}", printable(text), name, at->min, at->max));
        point[name] = *value;
    }
    return point;
}

class ModelEval final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "prints what a model gives at one point";
        line.description =
            "Prints the values that a model gives for one set of arguments: of a law the BRDF times the cosine of incidence, in 1/sr, and the radiance factor I/F. Arguments of --at by kind." +
            points_help();
        arguments_.declare(line);
        line.option("--at", &at_, "NAME=VALUE", "Argument; may be given several times");
        line.flag("--json", json_, "Print one JSON object");
        line.examples = {"obscura model eval akimov --at incidence=30 --at emission=10",
                         "obscura model eval rock.brdf --set albedo=0.3 --at incidence=45"};
    }

    int run() override {
        const models::ModelValues p = arguments_.model();
        const KindTools& tools = tools_of(*p.loaded->model);
        if (tools.eval == nullptr) refuse_kind(tools, "eval");
        print_facts(tools.eval(p, read_point(tools, at_)), json_);
        return exit_ok;
    }

private:
    ModelArguments arguments_;
    std::vector<std::string> at_;
    bool json_ = false;
};

class ModelPlot final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "draws a model, or writes a table of it";
        line.description = "What is drawn is chosen by the ending of the file.";
        for (const KindTools* tools : kind_tools())
            for (const auto& [ending, what] : tools->plots)
                line.description += fmt::format(" {} model, {}: {}.", tools->kind, ending, what);
        arguments_.declare(line);
        line.option("-o,--output", &output_, "FILE", "File to write: .png, .svg or .csv").required = true;
        line.examples = {"obscura model plot hapke -o hapke.png",
                         "obscura model plot rock.brdf --set gloss=0.3 -o rock.svg"};
    }

    int run() override {
        const models::ModelValues p = arguments_.model();
        const KindTools& tools = tools_of(*p.loaded->model);
        if (tools.plot == nullptr) refuse_kind(tools, "plot");
        const std::filesystem::path file = output_;
        std::vector<std::string_view> endings;
        for (const auto& [ending, what] : tools.plots)
            endings.push_back(ending);
        host::require_ending("--output", file, endings);
        tools.plot(p, arguments_.title(), file);
        return exit_ok;
    }

private:
    ModelArguments arguments_;
    std::string output_;
};

class ModelBench final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "measures what a model costs beside what is built in";
        line.description =
            "Prints nanoseconds a sample, least of many repeats, of the model and of what is built in, in packets of 16 samples, as rendering asks for them. Of a sensor: of each pixel, in rows of 1024. The built-in Hapke is that of a surface with a roughness of 20 degrees.";
        arguments_.declare(line);
        line.flag("--json", json_, "Print one JSON object");
        line.examples = {"obscura model bench hapke"};
    }

    int run() override {
        const models::ModelValues p = arguments_.model();
        const KindTools& tools = tools_of(*p.loaded->model);
        if (tools.bench == nullptr) refuse_kind(tools, "bench");
        ModelFacts facts = tools.bench(p);
        if (json_) {
            nlohmann::json report{{facts[0].name, facts[0].value}};
            for (std::size_t i = 1; i < facts.size(); ++i)
                report["built_in_ns"][facts[i].name] = facts[i].value;
            fmt::print("{}\n", report.dump());
            return exit_ok;
        }
        facts[0].label = arguments_.title();
        facts[0].text += " ns a sample";
        print_facts(facts, false);
        return exit_ok;
    }

private:
    ModelArguments arguments_;
    bool json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_model_eval() {
    return std::make_unique<ModelEval>();
}
std::unique_ptr<Verb> make_model_plot() {
    return std::make_unique<ModelPlot>();
}
std::unique_ptr<Verb> make_model_bench() {
    return std::make_unique<ModelBench>();
}

} // namespace obscura::tools
