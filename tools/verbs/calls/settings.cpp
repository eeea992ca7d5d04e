// SPDX-License-Identifier: Apache-2.0
// Verbs `obscura get` and `obscura set`: settings of a running camera by their SFNC names.
#include "host/setting_text.hpp"
#include "tools/verbs/calls/calling_verb.hpp"

#include <fmt/format.h>

#include <string>
#include <vector>

namespace obscura::tools {
namespace {

void print_lines(const host::CallJson& values) {
    for (const auto& [name, value] : values.items())
        fmt::print("{}={}\n", name, host::plain_text(value));
}

class Get final : public CallingVerb {
public:
    Get() : CallingVerb("get", DaemonOptions::Has::camera) {}

    void declare(host::CommandLine& line) override {
        line.summary = "prints settings of a running camera";
        line.description =
            "Prints the value of one setting alone, as scripts want it, and of several, or without NAME of all, lines NAME=VALUE that `obscura set` takes. "
            "Names are those of SFNC, as over GigE Vision; "
            "`obscura features` tells unit and range of each.";
        line.positional("NAME", &names_, "Settings, for example ExposureTime (default: all)").required =
            false;
        declare_daemon(line);
        line.flag("--json", json_, "Print one JSON object");
        line.examples = {"obscura get", "obscura get ExposureTime", "obscura get Gain BlackLevel --json"};
    }

    int work() override {
        const host::CallJson all = connect()->ask("camera.get", daemon().fields()).at("values");
        host::CallJson values = names_.empty() ? all : host::CallJson::object();
        for (const std::string& name : names_) {
            host::require_member("get", all, name);
            values[name] = all.at(name);
        }
        if (json_)
            fmt::print("{}\n", values.dump());
        else if (names_.size() == 1)
            fmt::print("{}\n", host::plain_text(values.front()));
        else
            print_lines(values);
        return exit_ok;
    }

private:
    std::vector<std::string> names_;
    bool json_ = false;
};

class Set final : public CallingVerb {
public:
    Set() : CallingVerb("set", DaemonOptions::Has::camera) {}

    void declare(host::CommandLine& line) override {
        line.summary = "changes settings of a running camera";
        line.description =
            "All of them change with the next frame, or none if one is wrong. "
            "Prints what has changed, also what changed with it. "
            "While a GigE Vision client controls the camera, the camera is the client's: the exit status is 75, and nothing changes (--force, or `obscura release`, which takes control from the client). "
            "A value that is refused ends with 78 and says what is allowed.";
        line.positional("SETTING", &words_,
                        "NAME=VALUE: a setting and its new value, for example ExposureTime=5000");
        declare_daemon(line);
        line.flag("--force", force_,
                  "Change them also while a GigE Vision client controls the camera; "
                  "only root and the daemon's user may, and the log tells of it");
        line.flag("--json", json_, "Print what has changed as one JSON object");
        line.examples = {"obscura set ExposureTime=5000 Gain=6",
                         "obscura set TriggerMode=On TriggerSource=Software && obscura trigger",
                         "obscura get > before.txt; obscura set $(grep Trigger before.txt)"};
    }

    int work() override {
        host::CallJson fields = daemon().fields();
        fields["values"] = host::assignments("set", words_);
        if (force_) fields["force"] = true;
        const host::CallJson changed = connect()->ask("camera.set", fields).at("changed");
        if (json_)
            fmt::print("{}\n", changed.dump());
        else if (changed.empty())
            fmt::print("nothing has changed: the camera had these values\n");
        else
            print_lines(changed);
        return exit_ok;
    }

private:
    std::vector<std::string> words_;
    bool force_ = false, json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_get() {
    return std::make_unique<Get>();
}

std::unique_ptr<Verb> make_set() {
    return std::make_unique<Set>();
}

} // namespace obscura::tools
