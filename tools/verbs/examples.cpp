// SPDX-License-Identifier: Apache-2.0
// Verb `obscura examples`: lists, explains and copies the shipped examples.
#include "core/error.hpp"
#include "tools/pages/example_files.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <system_error>

namespace obscura::tools {
namespace {

namespace fs = std::filesystem;

class Examples final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "lists, explains and copies examples to start from";
        line.description =
            "Without NAME the shipped examples are listed, a line each. "
            "With NAME the explanation of one is printed: what it shows, what hardware it needs, the commands that run it and what they print. --copy puts its files into a new folder, where these commands work.";
        host::Option& name = line.positional("NAME", &name_, "Example to explain or copy");
        name.required = false;
        name.choices = names();
        line.option("--copy", &copy_, "DIR",
                    "Copy the example's files to DIR, which is created, or may be an empty folder");
        line.flag("--json", json_, "Print JSON");
        line.examples = {"obscura examples", "obscura examples lockstep",
                         "obscura examples lockstep --copy my-lockstep"};
    }

    int run() override {
        if (!copy_.empty() && name_.empty())
            throw host::UsageError(
                "obscura examples: --copy needs the NAME of an example (try: obscura examples)");
        const std::vector<Example> all = examples();
        if (name_.empty()) return list(all);
        const auto found = std::find_if(all.begin(), all.end(),
                                        [&](const Example& example) { return example.name == name_; });
        if (found == all.end())
            throw host::UsageError(fmt::format("obscura examples: no example \"{}\"", name_.substr(0, 60)));
        return copy_.empty() ? explain(*found) : copy(*found);
    }

private:
    /// Names for --help and completion; empty where the examples cannot be read, which run() reports.
    static std::vector<std::string> names() {
        std::vector<std::string> known;
        try {
            for (const Example& example : examples())
                known.push_back(example.name);
        } catch (const Error&) {
            known.clear();
        }
        return known;
    }

    static nlohmann::ordered_json to_json(const Example& example) {
        return {{"name", example.name},
                {"summary", example.header.front()},
                {"folder", example.folder.string()},
                {"file", example.main_file.filename().string()},
                {"text", fmt::format("{}\n", fmt::join(example.header, "\n"))}};
    }

    int list(const std::vector<Example>& all) const {
        nlohmann::ordered_json json = nlohmann::ordered_json::array();
        std::string text;
        for (const Example& example : all) {
            json.push_back(to_json(example));
            text += fmt::format("{:<14} {}\n", example.name, example.header.front());
        }
        text += "\n`obscura examples NAME` explains one, `obscura examples NAME --copy DIR` copies it.\n";
        std::fputs(json_ ? (json.dump(2) + "\n").c_str() : text.c_str(), stdout);
        return exit_ok;
    }

    int explain(const Example& example) const {
        if (json_)
            fmt::print("{}\n", to_json(example).dump(2));
        else
            fmt::print("{}\n\nThe files are in {}; to try it: obscura examples {} --copy {}\n",
                       fmt::join(example.header, "\n"), example.folder.string(), example.name, example.name);
        return exit_ok;
    }

    int copy(const Example& example) const {
        const fs::path to(copy_);
        std::error_code error;
        if (fs::exists(to, error) && !fs::is_empty(to, error))
            throw host::UsageError(fmt::format("obscura examples: {} exists and is not empty", copy_));
        fs::create_directories(to, error);
        // Shipped files may be read-only, or owned by root: copies are the user's own.
        if (!error) fs::copy(example.folder, to, fs::copy_options::recursive, error);
        if (error) throw OutputError(fmt::format("{}: {}", copy_, error.message()), error.value());
        if (json_) {
            fmt::print("{}\n", to_json(example).dump(2));
            return exit_ok;
        }
        fmt::print("{}: copied; {} explains it. To run it:\n\n  cd {}\n", copy_,
                   (to / example.main_file.filename()).string(), copy_);
        for (const std::string& line : example.run_lines())
            fmt::print("  {}\n", line);
        return exit_ok;
    }

    std::string name_, copy_;
    bool json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_examples() {
    return std::make_unique<Examples>();
}

} // namespace obscura::tools
