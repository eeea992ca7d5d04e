// SPDX-License-Identifier: Apache-2.0
// Main program of `obscura VERB`, the command line beside the daemon.
#include "core/io/stop_reading.hpp"
#include "core/text/printable.hpp"
#include "core/text/suggestion.hpp"
#include "host/interrupt.hpp"
#include "host/standard_output.hpp"
#include "tools/verbs/verb.hpp"
#include "tools/verbs/verb_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <new>
#include <optional>
#include <string>
#include <vector>

#ifndef OBSCURA_VERSION
#error "OBSCURA_VERSION comes from the build"
#endif

namespace {

using namespace obscura;
using namespace obscura::tools;

/// Verbs whose names begin so, with what they do.
std::string list_of(std::string_view beginning) {
    std::string out;
    std::size_t width = 0;
    for (const VerbEntry& entry : verbs())
        if (entry.name.rfind(beginning, 0) == 0) width = std::max(width, entry.name.size());
    for (const VerbEntry& entry : verbs()) {
        if (entry.name.rfind(beginning, 0) != 0) continue;
        host::CommandLine line;
        entry.make()->declare(line);
        out += fmt::format("  {:<{}}  {}\n", entry.name, width, line.summary);
    }
    return out;
}

/// Help of the verbs that share their first word, as "scene list" and "scene show".
void print_family(std::string_view word) {
    fmt::print("Usage: obscura {0} VERB [ARGUMENT]...\n"
               "\n"
               "Verbs:\n"
               "{1}\n"
               "`obscura {0} VERB --help` explains one, with examples.\n",
               word, list_of(fmt::format("{} ", word)));
}

void print_help() {
    std::string out = "obscura - renders, captures and receives the frames of an emulated space camera\n"
                      "\n"
                      "Usage: obscura VERB [ARGUMENT]...\n"
                      "\n"
                      "Verbs:\n";
    out += list_of("");
    out += "\n"
           "`obscura VERB --help` explains a verb, with examples. The camera itself is the daemon:\n"
           "`obscurad --help`.\n"
           "\n"
           "First steps:\n"
           "  obscura examples                                      # examples to copy and start from\n"
           "  obscura new scene && obscura new camera               # files with every key, commented\n"
           "  obscura check config/demo.toml                        # is the configuration sound?\n"
           "  obscura render config/scenes/demo.toml -o demo.exr    # what the camera would see, W/m2\n"
           "  obscurad --config config/demo.toml &                  # start the camera\n"
           "  obscura grab --address 127.0.0.1 --frames 25 -o out   # receive frames from it\n"
           "  obscura set ExposureTime=8000                         # change it while it runs\n";
    std::fputs(out.c_str(), stdout);
}

/// Runs the verb beside its watch. An interrupted verb that has not done all ends by the signal, after what
/// it says of it.
int run_watched(Verb& verb, const std::string& name) {
    const std::optional<int> own_status = verb.runs_until_told() ? exit_ok : verb.interrupted_status();
    const auto run = [&] {
        const VerbWatch watch({.verb = name,
                               .shows_progress = !verb.runs_until_told(),
                               .keeps_work = verb.keeps_work(),
                               .interrupted_status = own_status});
        return verb.run();
    };
    if (own_status) return run();
    try {
        const int status = run();
        if (status != exit_failure || !host::interrupted()) return status;
    } catch (const Error& error) {
        if (!host::interrupted()) throw;
        print_message(error.what());
    }
    std::fflush(stdout);
    host::end_by_interrupt();
}

int run(const std::vector<std::string>& arguments) {
    if (arguments.empty()) throw host::UsageError("obscura: a verb is missing (try: obscura --help)");
    host::catch_interrupts();
    const StopReading stop_reading(host::interrupted);
    std::string verb = arguments.front();
    std::size_t words = 1;
    // A verb of two words, as "import stars", goes before the one of the first word.
    if (arguments.size() > 1)
        for (const VerbEntry& entry : verbs())
            if (entry.name == verb + " " + arguments[1]) {
                verb = entry.name;
                words = 2;
                break;
            }
    if (verb == "--help" || verb == "-h" || verb == "help") {
        print_help();
        return exit_ok;
    }
    if (verb == "--version" || verb == "-V") {
        fmt::print("obscura {}\n", OBSCURA_VERSION);
        return exit_ok;
    }
    std::vector<std::string_view> known;
    for (const VerbEntry& entry : verbs()) {
        known.push_back(entry.name);
        if (entry.name != verb) continue;
        const std::unique_ptr<Verb> made = entry.make();
        host::CommandLine line;
        made->declare(line);
        if (!line.parse(verb, {arguments.begin() + static_cast<std::ptrdiff_t>(words), arguments.end()}))
            return exit_ok;
        return run_watched(*made, verb);
    }
    const std::string word = verb.substr(0, 60);
    std::string second;
    for (const VerbEntry& entry : verbs())
        if (entry.name.substr(0, word.size() + 1) == word + " ")
            second += fmt::format("{}{}", second.empty() ? "" : ", ", entry.name.substr(word.size() + 1));
    if (!second.empty() && arguments.size() > 1 && (arguments[1] == "--help" || arguments[1] == "-h")) {
        print_family(word);
        return exit_ok;
    }
    if (!second.empty())
        throw host::UsageError(fmt::format(
            "obscura {}: a second word is missing, allowed {} (try: obscura {} --help)", word, second, word));
    throw host::UsageError(
        fmt::format("obscura: unknown verb \"{}\", {} (try: obscura --help)", word, suggestion(word, known)));
}

} // namespace

int main(int argc, char* argv[]) {
    try {
        return host::with_standard_output(
            [&] { return run(std::vector<std::string>(argv + 1, argv + argc)); });
    } catch (const Error& error) {
        print_message(error.what());
        return error.status();
    } catch (const std::bad_alloc&) {
        print_message("obscura: not enough memory for images of this size");
        return exit_failure;
    } catch (const std::exception& error) {
        print_message(fmt::format("obscura: internal error: {}", error.what()));
        return exit_software;
    }
}
