// SPDX-License-Identifier: Apache-2.0
// Verbs `obscura model new`, `list`, `show` and `check`: models written in SuMoL.
#include "tools/verbs/model.hpp"

#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "core/io/text_file.hpp"
#include "core/text/printable.hpp"
#include "images/writers/raw.hpp"
#include "models/language/parser.hpp"
#include "models/model/entry_points.hpp"
#include "models/model/model.hpp"
#include "tools/model/kind_tools.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <system_error>
#include <vector>

namespace obscura::tools {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string value_text(const models::Parameter& p) {
    if (p.type == models::Type::texture) return "image";
    std::vector<std::string> numbers;
    for (int c = 0; c < models::components(p.type); ++c)
        numbers.push_back(fmt::format("{}", p.value[static_cast<std::size_t>(c)]));
    const bool same =
        std::all_of(numbers.begin(), numbers.end(), [&](const std::string& n) { return n == numbers[0]; });
    return same ? numbers[0] : fmt::format("[{}]", fmt::join(numbers, ", "));
}

std::string range_text(const models::Parameter& p) {
    return std::isfinite(p.min) || std::isfinite(p.max) ? fmt::format("{} to {}", p.min, p.max) : "any";
}

std::string source_of(const fs::path& file) {
    std::string text;
    if (const std::string why = read_plain_text(file, models::max_source_bytes, text); !why.empty())
        throw InputError(fmt::format("{}: {}", file.string(), why), errno);
    return text;
}

class ModelNew final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "writes a commented model to begin with";
        line.description =
            "Writes a model in SuMoL that works as it is, with comments that say what can be changed. An existing file is kept unless --force is given.";
        std::vector<std::string> kinds;
        for (const models::ModelKind& kind : models::model_kinds())
            kinds.emplace_back(kind.name);
        line.positional("KIND", &kind_, "Kind of model").choices = std::move(kinds);
        line.positional("NAME", &name_, "Name of the file, without its ending");
        line.flag("--force", force_, "Replace the file if it exists");
        line.examples = {"obscura model new material rock && obscura model plot rock.brdf -o rock.png"};
    }

    int run() override {
        const auto& kinds = models::model_kinds();
        const auto kind =
            std::find_if(kinds.begin(), kinds.end(), [&](const auto& k) { return k.name == kind_; });
        fs::path file = name_;
        if (file.extension() != kind->ending) file += kind->ending;
        std::error_code error;
        if (!force_ && fs::exists(fs::symlink_status(file, error)))
            throw host::UsageError(
                fmt::format("obscura model new: {} exists; --force replaces it", file.string()));
        const auto tools = std::find_if(kind_tools().begin(), kind_tools().end(),
                                        [&](const KindTools* t) { return t->kind == kind_; });
        images::write_text(file, fmt::format(fmt::runtime((*tools)->new_text), file.stem().string()));
        fmt::print("{}\n", file.string());
        return exit_ok;
    }

private:
    std::string kind_, name_;
    bool force_ = false;
};

class ModelList final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "lists the models that come with the program";
        line.description =
            "Lists the shipped models with the first line of their text. Each can be named without path and ending: material = { model = \"akimov\" }.";
        line.flag("--json", json_, "Print a JSON list");
        line.examples = {"obscura model list"};
    }

    int run() override {
        json list = json::array();
        for (const fs::path& file : shipped_model_files()) {
            const std::string what = models::title_comment(source_of(file));
            const std::string_view kind = models::kind_of_file(file.string())->name;
            if (json_)
                list.push_back({{"name", file.stem().string()},
                                {"kind", kind},
                                {"file", file.string()},
                                {"what", what}});
            else
                fmt::print("{:24} {:10} {}\n", file.stem().string(), kind, what);
        }
        if (json_) fmt::print("{}\n", list.dump(2));
        return exit_ok;
    }

private:
    bool json_ = false;
};

class ModelShow final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "prints the parameters of a model and what it costs";
        line.description =
            "Prints kind, parameters with type, default, range and meaning, properties and functions of a model, and how many operations it takes for each sample.";
        line.positional("MODEL", &file_, "File, or name of a shipped model");
        line.flag("--json", json_, "Print one JSON object");
        line.flag("--listing", listing_, "Print the operations that are run for each sample, too");
        line.examples = {"obscura model show hapke", "obscura model show rock.brdf --json"};
    }

    int run() override {
        const models::ModelValues p = chosen_model(file_, {});
        const models::Model& model = *p.loaded->model;
        const ModelCost cost = tools_of(model).cost(p);
        json_ ? print_json(model, cost) : print_table(model, cost);
        if (listing_)
            for (const models::Instruction& i : cost.listing)
                fmt::print("{:4} = {}{}\n", i.slot, models::row_of(i.operation).name, operands_text(i));
        return exit_ok;
    }

private:
    static std::string operands_text(const models::Instruction& instruction) {
        std::string text;
        for (int k = 0; k < models::row_of(instruction.operation).operands; ++k) {
            const models::Operand& o = instruction.operands[static_cast<std::size_t>(k)];
            using Kind = models::Operand::Kind;
            text += fmt::format(" {}{}",
                                o.kind == Kind::slot    ? ""
                                : o.kind == Kind::input ? "input "
                                                        : "uniform ",
                                o.index);
        }
        return text;
    }

    static void print_table(const models::Model& model, const ModelCost& cost) {
        fmt::print("{}\n", model.name());
        if (const std::string what = models::title_comment(model.text()); !what.empty())
            fmt::print("{}\n", what);
        fmt::print("kind        {}\n", models::kind_of(model)->name);
        fmt::print("cost        {} operations a sample, {} values in use at once\n", cost.operations,
                   cost.slots);
        fmt::print("runs as     {}\n", cost.why_interpreted.empty()
                                           ? "machine code"
                                           : fmt::format("interpreted: {}", cost.why_interpreted));
        for (const ModelFact& fact : cost.facts)
            fmt::print("{:11} {}\n", fact.label, fact.text);
        for (const models::Property& p : model.properties())
            fmt::print("property    {} = {}\n", p.name, p.value);
        if (!model.parameters().empty())
            fmt::print("\n{:20} {:8} {:10} {:14} {:6} {}\n", "parameter", "type", "default", "allowed",
                       "unit", "meaning");
        for (const models::Parameter& p : model.parameters())
            fmt::print("{:20} {:8} {:10} {:14} {:6} {}{}\n", p.name, models::name_of(p.type), value_text(p),
                       range_text(p), p.unit, p.global ? "(global) " : "", printable(p.help));
    }

    static void print_json(const models::Model& model, const ModelCost& cost) {
        json parameters = json::array();
        for (const models::Parameter& p : model.parameters()) {
            json entry{{"name", p.name}, {"type", models::name_of(p.type)}, {"global", p.global},
                       {"unit", p.unit}, {"help", printable(p.help)},       {"line", p.at.line}};
            if (p.type != models::Type::texture)
                entry["default"] =
                    std::vector<double>(p.value.begin(), p.value.begin() + models::components(p.type));
            entry["min"] = std::isfinite(p.min) ? json(p.min) : json(nullptr);
            entry["max"] = std::isfinite(p.max) ? json(p.max) : json(nullptr);
            parameters.push_back(std::move(entry));
        }
        json functions = json::array();
        for (const models::Function& f : model.tree().functions)
            functions.push_back({{"name", f.name}, {"line", f.at.line}});
        json told{{"file", model.name()},
                  {"kind", models::kind_of(model)->name},
                  {"operations", cost.operations},
                  {"slots", cost.slots},
                  {"native", cost.why_interpreted.empty()},
                  {"parameters", std::move(parameters)},
                  {"functions", std::move(functions)}};
        for (const ModelFact& fact : cost.facts)
            told[fact.name] = fact.value;
        fmt::print("{}\n", told.dump(2));
    }

    std::string file_;
    bool json_ = false, listing_ = false;
};

class ModelCheck final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "reports all mistakes of models, and what they do wrong";
        line.description =
            "Reads each file and prints all that is found, a line each: FILE:LINE:COLUMN: what. "
            "Each that can be run is tested with its default parameters: of a law, whether it is finite, positive and reciprocal, and how much light it reflects, on 13,824 pairs of directions. "
            "Exit status 78 if a file has errors; warnings leave it 0.";
        line.positional("FILE", &files_, "Files, or names of shipped models");
        line.flag("--json", json_, "Print one JSON object for each finding, a line each");
        line.examples = {"obscura model check rock.brdf", "obscura model check *.brdf --json"};
    }

    int run() override {
        int status = exit_ok;
        for (const std::string& name : files_) {
            const std::string file = model_path(name).string();
            if (!check(file)) status = exit_config;
        }
        return status;
    }

private:
    /// Returns false if the file has errors.
    bool check(const std::string& file) {
        models::Findings findings;
        const auto model = models::Model::read(file, source_of(file), findings);
        for (const models::Finding& f : findings.sorted())
            print(file, f.at, f.error, f.what);
        if (model == nullptr) return false;
        try {
            const ModelVerdict found = tools_of(*model).check(models::defaults_of(models::load_model(file)));
            if (!found.refusal.empty()) print(file, found.at, true, found.refusal);
            for (const std::string& warning : found.warnings)
                print(file, found.at, false, warning);
            if (found.refusal.empty() && !json_) fmt::print("{}: sound: {}\n", file, found.summary);
            return found.refusal.empty();
        } catch (const ConfigError& error) {
            if (json_)
                fmt::print("{}\n",
                           json{{"file", file}, {"severity", "error"}, {"message", error.what()}}.dump());
            else
                fmt::print("{}\n", error.what());
            return false;
        }
    }

    void print(const std::string& file, models::Place at, bool error, const std::string& what) const {
        const std::string_view severity = error ? "error" : "warning";
        if (json_)
            fmt::print("{}\n", json{{"file", file},
                                    {"line", at.line},
                                    {"column", at.column},
                                    {"severity", severity},
                                    {"message", what}}
                                   .dump());
        else
            fmt::print("{}:{}:{}: {}{}\n", printable(file, 500), at.line, at.column,
                       error ? "" : "warning: ", what);
    }

    std::vector<std::string> files_;
    bool json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_model_new() {
    return std::make_unique<ModelNew>();
}
std::unique_ptr<Verb> make_model_list() {
    return std::make_unique<ModelList>();
}
std::unique_ptr<Verb> make_model_show() {
    return std::make_unique<ModelShow>();
}
std::unique_ptr<Verb> make_model_check() {
    return std::make_unique<ModelCheck>();
}

} // namespace obscura::tools
