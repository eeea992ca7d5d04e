// SPDX-License-Identifier: Apache-2.0
// Interface and list of the verbs of the `obscura` command line. Read this first: a verb is one source file
// in this folder, a maker declared below and a row in verbs.cpp.
#pragma once

#include "host/command_line.hpp"

#include <memory>
#include <optional>
#include <span>
#include <string_view>

namespace obscura::tools {

/// One verb, created for a single use: the main program calls declare() once, then run() unless --help was
/// given. Thread-bound.
class Verb {
public:
    virtual ~Verb() = default;
    /// Declares the arguments, whose targets are members of the verb.
    virtual void declare(host::CommandLine& line) = 0;
    /// Executes the verb and returns the exit status. Throws Error with a one-line message.
    virtual int run() = 0;
    /// Whether it runs until it is told to end: it shows no progress, and its status after an interrupt is
    /// its own.
    [[nodiscard]] virtual bool runs_until_told() const { return false; }
    /// Exit status after an interrupt; none: that of the signal.
    [[nodiscard]] virtual std::optional<int> interrupted_status() const { return std::nullopt; }
    /// Whether an interrupted verb keeps what is done for its next run. It is given time to do so, also on a
    /// busy machine.
    [[nodiscard]] virtual bool keeps_work() const { return false; }
};

struct VerbEntry {
    std::string_view name;
    std::unique_ptr<Verb> (*make)();
};

/// All verbs, in the order in which --help lists them.
[[nodiscard]] std::span<const VerbEntry> verbs();

[[nodiscard]] std::unique_ptr<Verb> make_render();
[[nodiscard]] std::unique_ptr<Verb> make_capture();
[[nodiscard]] std::unique_ptr<Verb> make_grab();
[[nodiscard]] std::unique_ptr<Verb> make_check();
[[nodiscard]] std::unique_ptr<Verb> make_keys();
[[nodiscard]] std::unique_ptr<Verb> make_pose();
[[nodiscard]] std::unique_ptr<Verb> make_examples();
[[nodiscard]] std::unique_ptr<Verb> make_new();
[[nodiscard]] std::unique_ptr<Verb> make_compare();
[[nodiscard]] std::unique_ptr<Verb> make_import_flight_image();
[[nodiscard]] std::unique_ptr<Verb> make_import_map();
[[nodiscard]] std::unique_ptr<Verb> make_import_stars();
[[nodiscard]] std::unique_ptr<Verb> make_import_ephemeris();
[[nodiscard]] std::unique_ptr<Verb> make_ephemeris();
[[nodiscard]] std::unique_ptr<Verb> make_bench();
[[nodiscard]] std::unique_ptr<Verb> make_stimulator();
[[nodiscard]] std::unique_ptr<Verb> make_sensor();
[[nodiscard]] std::unique_ptr<Verb> make_characterise();
[[nodiscard]] std::unique_ptr<Verb> make_time();
[[nodiscard]] std::unique_ptr<Verb> make_timing();
[[nodiscard]] std::unique_ptr<Verb> make_status();
[[nodiscard]] std::unique_ptr<Verb> make_events();
[[nodiscard]] std::unique_ptr<Verb> make_metrics();
[[nodiscard]] std::unique_ptr<Verb> make_get();
[[nodiscard]] std::unique_ptr<Verb> make_set();
[[nodiscard]] std::unique_ptr<Verb> make_features();
[[nodiscard]] std::unique_ptr<Verb> make_start();
[[nodiscard]] std::unique_ptr<Verb> make_stop();
[[nodiscard]] std::unique_ptr<Verb> make_frame();
[[nodiscard]] std::unique_ptr<Verb> make_probe();
[[nodiscard]] std::unique_ptr<Verb> make_scene_list();
[[nodiscard]] std::unique_ptr<Verb> make_scene_show();
[[nodiscard]] std::unique_ptr<Verb> make_fault_list();
[[nodiscard]] std::unique_ptr<Verb> make_fault_add();
[[nodiscard]] std::unique_ptr<Verb> make_fault_clear();
[[nodiscard]] std::unique_ptr<Verb> make_support_bundle();
[[nodiscard]] std::unique_ptr<Verb> make_web();
[[nodiscard]] std::unique_ptr<Verb> make_release();
[[nodiscard]] std::unique_ptr<Verb> make_trigger();
[[nodiscard]] std::unique_ptr<Verb> make_truth();
[[nodiscard]] std::unique_ptr<Verb> make_sky();
[[nodiscard]] std::unique_ptr<Verb> make_irradiance();
[[nodiscard]] std::unique_ptr<Verb> make_serve();

} // namespace obscura::tools
