// SPDX-License-Identifier: Apache-2.0
// obscura keys: every key of configurations, scene files and sensor files.
#include "core/text/suggestion.hpp"
#include "tools/pages/key_reference.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>

namespace obscura::tools {
namespace {

class Keys final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "lists every key of configurations, scene and sensor files";
        line.description =
            "Prints each table with its keys: default, type, unit, range or choices, and meaning. "
            "Without TABLE all tables are listed; "
            "TABLE is a table's path such as gige or gige.faults, or the name of a shape or material. "
            "The same text is in docs/reference.";
        line.positional("TABLE", &table_, "Table, or kind of shape or material").required = false;
        line.option("--of", &of_, "FILE", "Only the tables of one kind of file").choices = {
            "configuration", "scene", "sensor"};
        line.option("--markdown", &markdown_, "FILE", "The whole page of the reference for a kind of file")
            .choices = {"configuration", "scene", "sensor"};
        line.flag("--json", json_, "Print JSON");
        line.examples = {"obscura keys gige", "obscura keys camera.window", "obscura keys body --of scene",
                         "obscura keys --markdown configuration > docs/reference/configuration.md"};
    }

    int run() override {
        std::vector<KeyReference> references = key_references();
        if (!markdown_.empty()) {
            for (const KeyReference& reference : references)
                if (reference.name == markdown_) std::fputs(reference_page(reference).c_str(), stdout);
            return exit_ok;
        }
        std::string text;
        nlohmann::ordered_json json = nlohmann::ordered_json::array();
        std::vector<std::string_view> known;
        for (const KeyReference& reference : references) {
            if (!of_.empty() && reference.name != of_) continue;
            for (const std::string_view word : table_words(reference.tables))
                if (std::find(known.begin(), known.end(), word) == known.end()) known.push_back(word);
            const std::vector<config::DocumentedTable> tables =
                table_.empty() ? reference.tables : find_tables(reference, table_);
            if (tables.empty()) continue;
            text += fmt::format("{}== {}\n\n{}", text.empty() ? "" : "\n", reference.title,
                                reference_text(tables));
            for (const config::DocumentedTable& table : tables)
                json.push_back(to_json(reference, table));
        }
        if (json.empty())
            throw host::UsageError(
                fmt::format("obscura keys: no table \"{}\"; {}", table_, suggestion(table_, known)));
        std::fputs(json_ ? (json.dump(2) + "\n").c_str() : text.c_str(), stdout);
        return exit_ok;
    }

private:
    static nlohmann::ordered_json to_json(const KeyReference& reference,
                                          const config::DocumentedTable& table) {
        nlohmann::ordered_json keys = nlohmann::ordered_json::array();
        for (const config::Key& key : table.keys)
            keys.push_back({{"name", key.name},
                            {"type", type_text(key)},
                            {"unit", key.unit()},
                            {"allowed", allowed_text(key)},
                            {"minimum", key.range().min}, // null where unlimited
                            {"maximum", key.range().max},
                            {"choices", key.choices()},
                            {"default", key.is_required() ? "" : value_text(key)},
                            {"required", key.is_required()},
                            {"reloadable", key.is_reloadable()},
                            {"help", key.help()}});
        return {{"file", reference.name},
                {"table", table.heading},
                {"variant", table.variant},
                {"help", table.help},
                {"keys", std::move(keys)}};
    }

    std::string table_, of_, markdown_;
    bool json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_keys() {
    return std::make_unique<Keys>();
}

} // namespace obscura::tools
