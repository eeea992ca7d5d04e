// SPDX-License-Identifier: Apache-2.0
#include "host/support_bundle.hpp"

#include "host/setting_text.hpp"

#include <fmt/format.h>
#include <sys/utsname.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <iterator>

namespace obscura::host {
namespace {

constexpr std::array<std::string_view, 5> secret_words{"token", "password", "passwd", "secret", "key"};

/// Whether `name` ends with one of the words, in any case.
bool is_secret(std::string_view name) {
    return std::any_of(secret_words.begin(), secret_words.end(), [name](std::string_view word) {
        return name.size() >= word.size() &&
               std::equal(word.begin(), word.end(), name.end() - static_cast<std::ptrdiff_t>(word.size()),
                          [](char a, char b) { return a == std::tolower(static_cast<unsigned char>(b)); });
    });
}

std::string dumped(const CallJson& json) {
    return json.dump(1, ' ', false, CallJson::error_handler_t::replace) + "\n";
}

std::string file_text(const char* path) {
    std::ifstream in(path);
    if (!in) return "(cannot be read)\n";
    return {std::istreambuf_iterator<char>(in), {}};
}

std::string machine_text() {
    std::string text;
    utsname name{};
    if (uname(&name) == 0)
        text += fmt::format("# uname\n{} {} {} {}\n", name.sysname, name.release, name.version, name.machine);
    for (const char* const path :
         {"/proc/cmdline", "/etc/os-release", "/proc/loadavg", "/proc/meminfo", "/proc/interrupts",
          "/sys/devices/system/cpu/online", "/sys/devices/system/cpu/isolated",
          "/sys/devices/system/cpu/nohz_full", "/sys/kernel/realtime",
          "/sys/devices/system/clocksource/clocksource0/current_clocksource",
          "/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "/proc/sys/kernel/sched_rt_runtime_us",
          "/proc/sys/net/core/rmem_max", "/proc/sys/net/core/wmem_max", "/proc/net/dev"})
        text += fmt::format("\n# {}\n{}", path, without_secrets(file_text(path)));
    return text;
}

std::string threads_text(const CallJson& state) {
    std::string text =
        fmt::format("{:<16} {:<6} {:>8} {:>5} {:>12}\n", "NAME", "POLICY", "PRIORITY", "NICE", "CPU SECONDS");
    for (const CallJson& thread : state.at("threads"))
        text += fmt::format("{:<16} {:<6} {:>8} {:>5} {:>12}\n", plain_text(thread.at("name")),
                            plain_text(thread.at("policy")), plain_text(thread.at("priority")),
                            plain_text(thread.at("nice")), plain_text(thread.at("cpu_s")));
    return text;
}

/// All lines that the daemon still has, as often as one answer holds some.
std::string events_text(const AskDaemon& ask) {
    std::string text;
    std::uint64_t after = 0;
    constexpr int max_answers = 256;
    for (int i = 0; i < max_answers; ++i) {
        const CallJson events = ask("events", {{"after", after}}).at("events");
        if (events.empty()) break;
        for (const CallJson& event : events)
            text += fmt::format("{} {:<7} {}\n", plain_text(event.at("utc")), plain_text(event.at("level")),
                                without_secrets(plain_text(event.at("text"))));
        after = events.back().at("id").get<std::uint64_t>();
    }
    return text;
}

/// All rows of the timing log that the daemon still has, as CSV.
std::string timing_csv(const AskDaemon& ask, std::size_t camera) {
    constexpr int all = 1024;
    const CallJson answer = ask("timing", {{"camera", camera}, {"most", all}});
    std::string text;
    for (const CallJson& column : answer.at("columns"))
        text += fmt::format("{}{}", text.empty() ? "" : ",", plain_text(column));
    text += '\n';
    for (const CallJson& row : answer.at("rows")) {
        std::string line;
        for (const CallJson& cell : row)
            line += fmt::format("{}{}", &cell == &row.front() ? "" : ",",
                                cell.is_null() ? std::string() : plain_text(cell));
        text += line + '\n';
    }
    return text;
}

std::string configuration_text(const AskDaemon& ask) {
    CallJson answer = ask("configuration", CallJson::object());
    for (CallJson& entry : answer.at("entries"))
        if (is_secret(plain_text(entry.at("key")))) entry["value"] = "(left out)";
    return dumped(answer);
}

} // namespace

std::string without_secrets(std::string_view text) {
    std::string out;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t sign = text.find('=', at);
        out += text.substr(at, sign == std::string_view::npos ? sign : sign + 1 - at);
        if (sign == std::string_view::npos) break;
        at = sign + 1;
        if (!is_secret(text.substr(0, sign))) continue;
        out += "(left out)";
        at = std::min(text.find_first_of(" \t\n\"'&", at), text.size());
    }
    return out;
}

void SupportBundle::add(std::string_view name, std::string_view help,
                        const std::function<std::string()>& make) {
    try {
        archive_.add(name, make());
        contents_ += fmt::format("{:<24} {}\n", name, help);
        ++files_;
    } catch (const Interrupted&) {
        throw;
    } catch (const Error& error) {
        note_missing(name, error.what());
    } catch (const CallJson::exception& error) {
        note_missing(name, fmt::format("the answer is not as expected: {}", error.what()));
    }
}

void SupportBundle::note_missing(std::string_view name, std::string_view why) {
    missing_.push_back(fmt::format("{}: {}", name, why));
}

void SupportBundle::finish() {
    std::string text =
        "Support bundle of Obscura. It has no frames, no scene files and no tokens.\n\n" + contents_;
    if (!missing_.empty()) text += "\nMissing:\n";
    for (const std::string& one : missing_)
        text += one + "\n";
    archive_.add("README.txt", text);
    ++files_;
}

void add_machine(SupportBundle& bundle, std::string_view version) {
    bundle.add("version.txt", "program that made this", [&] { return fmt::format("obscura {}\n", version); });
    bundle.add("machine.txt", "kernel, its command line, processors, memory, interfaces", machine_text);
}

std::size_t add_daemon(SupportBundle& bundle, const AskDaemon& ask, bool all_calls) {
    CallJson state;
    bundle.add("state.json", "the daemon, its cameras, counters and latencies", [&] {
        state = ask("state", CallJson::object());
        return dumped(state);
    });
    bundle.add("threads.txt", "scheduling and processor time of the daemon's threads",
               [&] { return threads_text(state); });
    bundle.add("events.txt", "the daemon's log, as far back as it keeps it",
               [&] { return events_text(ask); });
    const CallJson cameras = state.value("cameras", CallJson::array());
    if (all_calls) {
        bundle.add("configuration.json", "each key with its value and where that comes from",
                   [&] { return configuration_text(ask); });
        for (std::size_t i = 0; i < cameras.size(); ++i) {
            bundle.add(fmt::format("camera{}-features.json", i), "settings of the camera", [&] {
                return dumped(ask("camera.features", {{"camera", i}}));
            });
            // Faults are those of a GigE Vision stream.
            if (cameras[i].value("transports", CallJson::object()).contains("gige"))
                bundle.add(fmt::format("camera{}-faults.json", i), "faults that it injects", [&] {
                    return dumped(ask("faults.list", {{"camera", i}}).at("rules"));
                });
            bundle.add(fmt::format("camera{}-timing.csv", i), "time stamps of its newest frames",
                       [&] { return timing_csv(ask, i); });
        }
    }
    return static_cast<std::size_t>(std::count_if(cameras.begin(), cameras.end(), [](const CallJson& camera) {
        return camera.value("acquiring", false);
    }));
}

void add_self_test(SupportBundle& bundle, const std::function<std::string()>& test) {
    bundle.add("self-test.txt", "how late this machine releases rows", test);
}

} // namespace obscura::host
