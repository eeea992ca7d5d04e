// Read this first: a verb of the `obscura` command line; one file pair per verb and one line in verbs.cpp.
#pragma once

#include "tools/support/command_line.hpp"

#include <memory>
#include <span>
#include <string_view>

namespace obscura::tools {

/// One verb. Made anew for each use; declare() is called once, then run() unless --help was asked for.
class Verb {
public:
    virtual ~Verb() = default;
    /// Says what arguments there are; the targets are members of the verb.
    virtual void declare(CommandLine& line) = 0;
    /// Does the work; the result is the exit status. Throws Error with one line.
    virtual int run() = 0;
};

struct VerbEntry {
    std::string_view name;
    std::unique_ptr<Verb> (*make)();
};

/// All verbs, in the order of the help.
[[nodiscard]] std::span<const VerbEntry> verbs();

[[nodiscard]] std::unique_ptr<Verb> make_render();
[[nodiscard]] std::unique_ptr<Verb> make_capture();
[[nodiscard]] std::unique_ptr<Verb> make_grab();
[[nodiscard]] std::unique_ptr<Verb> make_check();
[[nodiscard]] std::unique_ptr<Verb> make_compare();
[[nodiscard]] std::unique_ptr<Verb> make_import();
[[nodiscard]] std::unique_ptr<Verb> make_bench();
[[nodiscard]] std::unique_ptr<Verb> make_stimulator();
[[nodiscard]] std::unique_ptr<Verb> make_sensor();
[[nodiscard]] std::unique_ptr<Verb> make_characterise();
[[nodiscard]] std::unique_ptr<Verb> make_timing();

} // namespace obscura::tools
