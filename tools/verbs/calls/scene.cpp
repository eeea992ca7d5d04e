// SPDX-License-Identifier: Apache-2.0
// Verbs `obscura scene list` and `obscura scene show`: the scene that a running daemon shows.
#include "host/setting_text.hpp"
#include "tools/verbs/calls/calling_verb.hpp"

#include <fmt/format.h>

#include <string>

namespace obscura::tools {
namespace {

class SceneList final : public CallingVerb {
public:
    SceneList() : CallingVerb("scene list", DaemonOptions::Has::daemon) {}

    void declare(host::CommandLine& line) override {
        line.summary = "lists the scenes that a running daemon can show";
        line.description =
            "Prints a name a line, those that `obscura scene show` takes: scene files below control.scenes, and the shipped ones. "
            "A star stands before the one that is shown now; behind one that cannot take its place stands why.";
        declare_daemon(line);
        line.flag("--json", json_, "Print one JSON object");
        line.examples = {"obscura scene list"};
    }

protected:
    int work() override {
        const host::CallJson answer = connect()->ask("scene.list", host::CallJson::object());
        if (json_) {
            fmt::print("{}\n", answer.dump());
            return exit_ok;
        }
        const std::string shown = host::plain_text(answer.at("shown"));
        bool listed = false;
        for (const host::CallJson& scene : answer.at("scenes")) {
            const std::string name = host::plain_text(scene);
            listed = listed || name == shown;
            const host::CallJson reasons = answer.value("why_not", host::CallJson::object());
            const auto why = reasons.find(name);
            fmt::print("{} {}{}\n", name == shown ? '*' : ' ', name,
                       why == reasons.end() ? ""
                                            : fmt::format("  cannot be shown: {}", host::plain_text(*why)));
        }
        if (!listed) fmt::print("* {}\n", shown);
        return exit_ok;
    }

private:
    bool json_ = false;
};

class SceneShow final : public CallingVerb {
public:
    SceneShow() : CallingVerb("scene show", DaemonOptions::Has::daemon) {}

    void declare(host::CommandLine& line) override {
        line.summary = "shows another scene from a frame on";
        line.description =
            "The daemon builds the scene while frames of the present one continue, and puts it in their place between two frames. "
            "If it cannot be shown, nothing changes and the exit status is 78. "
            "A reload (systemctl reload obscurad) returns to the scene of the configuration.";
        line.positional("NAME", &scene_, "Shipped scene, or scene file below control.scenes");
        declare_daemon(line);
        line.examples = {"obscura scene show demo", "obscura scene show approach/day2.toml"};
    }

protected:
    int work() override {
        constexpr double max_build_s = 600;
        (void)connect(max_build_s)->ask("scene.show", {{"file", scene_}});
        fmt::print("{} is shown\n", scene_);
        return exit_ok;
    }

private:
    std::string scene_;
};

} // namespace

std::unique_ptr<Verb> make_scene_list() {
    return std::make_unique<SceneList>();
}

std::unique_ptr<Verb> make_scene_show() {
    return std::make_unique<SceneShow>();
}

} // namespace obscura::tools
