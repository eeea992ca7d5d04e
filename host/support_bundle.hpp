// SPDX-License-Identifier: Apache-2.0
// Contents of a support bundle: what a maintainer wants to know of a machine and its daemon.
#pragma once

#include "host/daemon_calls.hpp"
#include "host/tar_archive.hpp"

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::host {

/// `text` without the values of words such as "token=..." and "password=...".
[[nodiscard]] std::string without_secrets(std::string_view text);

/// Collects files, and what could not be had. Thread-bound.
class SupportBundle {
public:
    explicit SupportBundle(TarArchive& archive) : archive_(archive) {}

    /// Adds a file with what `make` returns; `help`: what the file is. What `make` throws as an Error or as
    /// an exception of JSON is noted instead.
    void add(std::string_view name, std::string_view help, const std::function<std::string()>& make);
    /// Notes that something is missing.
    void note_missing(std::string_view name, std::string_view why);
    /// Adds the list of all files and of what is missing as README.txt.
    void finish();

    [[nodiscard]] std::size_t files() const noexcept { return files_; }
    [[nodiscard]] const std::vector<std::string>& missing() const noexcept { return missing_; }

private:
    TarArchive& archive_;
    std::string contents_;
    std::vector<std::string> missing_;
    std::size_t files_ = 0;
};

/// Kernel, its command line, processors, load and memory.
void add_machine(SupportBundle& bundle, std::string_view version);

/// Asks a daemon for a call of docs/reference/camera-calls.md.
using AskDaemon = std::function<CallJson(const std::string& call, const CallJson& fields)>;

/// State, threads, log; with `all_calls`, which a monitor socket does not answer, also configuration,
/// settings, faults and timing of each camera. Returns the number of cameras that acquire.
std::size_t add_daemon(SupportBundle& bundle, const AskDaemon& ask, bool all_calls);

/// How late this machine releases rows: the text of a self-test, which `test` makes.
void add_self_test(SupportBundle& bundle, const std::function<std::string()>& test);

} // namespace obscura::host
