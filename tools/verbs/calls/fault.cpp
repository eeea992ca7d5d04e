// SPDX-License-Identifier: Apache-2.0
// Verbs `obscura fault list`, `add` and `clear`: faults that a running camera injects into its stream.
#include "host/setting_text.hpp"
#include "tools/verbs/calls/calling_verb.hpp"

#include <fmt/format.h>

#include <string>
#include <utility>
#include <vector>

namespace obscura::tools {
namespace {

/// "lose             percent=1 first=1 ...  struck 12"
void print_rule(const host::CallJson& rule) {
    std::string parameters;
    for (const auto& [name, value] : rule.items())
        if (name != "kind" && name != "struck" && name != "origin")
            parameters +=
                fmt::format("{}{}={}", parameters.empty() ? "" : " ", name, host::plain_text(value));
    fmt::print("{:<16} {}  struck {}\n", host::plain_text(rule.at("kind")), parameters,
               host::plain_text(rule.value("struck", host::CallJson(0))));
}

void print_rules(const host::CallJson& rules) {
    if (rules.empty()) fmt::print("no faults\n");
    for (const host::CallJson& rule : rules)
        print_rule(rule);
}

/// Names with their meaning.
void print_meanings(const host::CallJson& rows) {
    for (const host::CallJson& row : rows) {
        const std::string allowed = host::plain_text(row.value("allowed", host::CallJson("")));
        fmt::print("{:<16} {}{}\n", host::plain_text(row.at("name")),
                   host::plain_text(row.value("help", host::CallJson(""))),
                   allowed.empty() ? std::string() : fmt::format(" ({})", allowed));
    }
}

class FaultList final : public CallingVerb {
public:
    FaultList() : CallingVerb("fault list", DaemonOptions::Has::camera) {}

    void declare(host::CommandLine& line) override {
        line.summary = "lists the faults that a running camera injects";
        line.description =
            "Prints a line for each rule: kind, parameters, and how often it has struck. "
            "Faults are put into the GigE Vision stream, as [[gige.faults]] of the configuration does it; "
            "frames are rendered and counted as ever.";
        declare_daemon(line);
        line.flag("--kinds", kinds_, "List the kinds of faults and their parameters instead");
        line.flag("--json", json_, "Print one JSON object with kinds and rules");
        line.examples = {"obscura fault list", "obscura fault list --kinds"};
    }

protected:
    int work() override {
        const host::CallJson answer = connect()->ask("faults.list", daemon().fields());
        if (json_) {
            fmt::print("{}\n", answer.dump());
        } else if (kinds_) {
            fmt::print("Kinds:\n");
            print_meanings(answer.at("kinds"));
            fmt::print("\nParameters:\n");
            print_meanings(answer.value("parameters", host::CallJson::array()));
        } else {
            print_rules(answer.at("rules"));
        }
        return exit_ok;
    }

private:
    bool kinds_ = false, json_ = false;
};

class FaultAdd final : public CallingVerb {
public:
    FaultAdd() : CallingVerb("fault add", DaemonOptions::Has::camera) {}

    void declare(host::CommandLine& line) override {
        line.summary = "makes a running camera inject a fault";
        line.description =
            "Adds a rule to those that hold. "
            "Parameters are the keys of [[gige.faults]]: percent, first, last, every, burst_packets, amount, seed. "
            "All rules hold until `obscura fault clear`, or the end of the daemon. Prints all rules.";
        line.positional("KIND", &kind_, "Kind of fault, as `obscura fault list --kinds` lists them");
        line.positional("PARAMETER", &words_, "NAME=VALUE: a parameter of the rule").required = false;
        declare_daemon(line);
        line.examples = {"obscura fault add lose percent=1", "obscura fault add skip_frame every=10 last=100",
                         "obscura fault add delay amount=200 percent=5 seed=7"};
    }

protected:
    int work() override {
        host::CallJson rule{{"kind", kind_}};
        rule.update(host::assignments(name(), words_));
        const auto calls = connect();
        host::CallJson fields = daemon().fields();
        fields["rules"] = calls->ask("faults.list", fields).at("rules");
        fields["rules"].push_back(std::move(rule));
        print_rules(calls->ask("faults.set", fields).at("rules"));
        return exit_ok;
    }

private:
    std::string kind_;
    std::vector<std::string> words_;
};

class FaultClear final : public CallingVerb {
public:
    FaultClear() : CallingVerb("fault clear", DaemonOptions::Has::camera) {}

    void declare(host::CommandLine& line) override {
        line.summary = "ends all faults that a running camera injects";
        line.description =
            "Removes all rules, also those of the configuration until the daemon starts again.";
        declare_daemon(line);
        line.examples = {"obscura fault clear"};
    }

protected:
    int work() override {
        host::CallJson fields = daemon().fields();
        fields["rules"] = host::CallJson::array();
        print_rules(connect()->ask("faults.set", fields).at("rules"));
        return exit_ok;
    }
};

} // namespace

std::unique_ptr<Verb> make_fault_list() {
    return std::make_unique<FaultList>();
}

std::unique_ptr<Verb> make_fault_add() {
    return std::make_unique<FaultAdd>();
}

std::unique_ptr<Verb> make_fault_clear() {
    return std::make_unique<FaultClear>();
}

} // namespace obscura::tools
