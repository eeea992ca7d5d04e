// SPDX-License-Identifier: Apache-2.0
// Verb `obscura features`: what can be set on a running camera.
#include "core/text/printable.hpp"
#include "core/text/suggestion.hpp"
#include "core/text/text.hpp"
#include "host/setting_text.hpp"
#include "tools/verbs/calls/calling_verb.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <set>
#include <string>
#include <vector>

namespace obscura::tools {
namespace {

std::string member(const host::CallJson& row, const char* name) {
    const auto found = row.find(name);
    return found == row.end() || found->is_null() ? std::string() : host::plain_text(*found);
}

/// "rw", or "ro" and why.
std::string access_of(const host::CallJson& row) {
    if (!row.value("locked", false)) return "rw";
    const std::string why = member(row, "why");
    return "ro: " + (why.empty() ? std::string("not while it acquires") : why);
}

class Features final : public CallingVerb {
public:
    Features() : CallingVerb("features", DaemonOptions::Has::camera) {}

    void declare(host::CommandLine& line) override {
        line.summary = "lists what can be set on a running camera, with unit and range";
        line.description =
            "One line for each setting: name, value, unit, access and what is allowed. "
            "Access is rw, or ro with the reason why the setting cannot change now. "
            "Names are those of SFNC; selectors, user sets and chunks are reached over GigE Vision.";
        line.positional(
                "CATEGORY", &category_,
                "Only settings of this SFNC category, or with this in their name, for example Trigger (default: all)")
            .required = false;
        declare_daemon(line);
        line.flag("--long", long_, "Also print what each setting means");
        line.flag("--json", json_, "Print one JSON array, with the meaning of each setting as \"help\"");
        line.examples = {"obscura features", "obscura features Trigger --long",
                         "obscura features --json | jq '.[] | select(.locked) | .name'"};
    }

    int work() override {
        const auto calls = connect();
        host::CallJson rows = chosen(calls->ask("camera.features", daemon().fields()).at("features"));
        if (json_)
            fmt::print("{}\n", rows.dump());
        else
            print(rows, controller(*calls));
        return exit_ok;
    }

private:
    [[nodiscard]] host::CallJson chosen(const host::CallJson& all) const {
        const std::string wanted = lower_case(category_);
        host::CallJson rows = host::CallJson::array();
        for (const host::CallJson& row : all)
            if (lower_case(member(row, "category")) == wanted ||
                lower_case(member(row, "name")).find(wanted) != std::string::npos)
                rows.push_back(row);
        if (!rows.empty()) return rows;
        std::set<std::string> names;
        for (const host::CallJson& row : all)
            for (const char* const key : {"name", "category"})
                if (const std::string name = member(row, key); !name.empty()) names.insert(name);
        throw host::CallError("bad-argument",
                              fmt::format("obscura features: no setting or category \"{}\", {}",
                                          category_.substr(0, 60),
                                          suggestion(category_, {names.begin(), names.end()})));
    }

    /// Address of the client that controls the camera; empty: none does.
    [[nodiscard]] std::string controller(host::DaemonCalls& calls) const {
        const host::CallJson state = calls.ask("state", host::CallJson::object());
        const host::CallJson::json_pointer place(fmt::format("/cameras/{}/controller", daemon().camera()));
        return state.contains(place) && state.at(place).is_string()
                   ? for_terminal(state.at(place).get<std::string>())
                   : std::string();
    }

    void print(const host::CallJson& rows, const std::string& controller) const {
        using Cells = std::array<std::string, 5>;
        std::vector<Cells> lines{{"NAME", "VALUE", "UNIT", "ACCESS", "ALLOWED"}};
        for (const host::CallJson& row : rows)
            lines.push_back({member(row, "name"), member(row, "value"), member(row, "unit"), access_of(row),
                             member(row, "allowed")});
        std::array<std::size_t, 5> widths{};
        for (const Cells& line : lines)
            for (std::size_t i = 0; i < line.size(); ++i)
                widths[i] = std::max(widths[i], line[i].size());
        if (!controller.empty())
            fmt::print("controlled by {}: obscura set changes nothing without --force\n", controller);
        for (std::size_t i = 0; i < lines.size(); ++i) {
            const Cells& c = lines[i];
            fmt::print("{:<{}}  {:<{}}  {:<{}}  {:<{}}  {}\n", c[0], widths[0], c[1], widths[1], c[2],
                       widths[2], c[3], widths[3], c[4]);
            if (long_ && i > 0) fmt::print("    {}\n", member(rows[i - 1], "help"));
        }
    }

    std::string category_;
    bool long_ = false, json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_features() {
    return std::make_unique<Features>();
}

} // namespace obscura::tools
