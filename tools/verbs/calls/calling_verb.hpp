// SPDX-License-Identifier: Apache-2.0
// Verb that calls a running daemon: its options, and what of an answer is not as it should be.
#pragma once

#include "tools/control/daemon_options.hpp"
#include "tools/verbs/verb.hpp"

#include <memory>
#include <string_view>

namespace obscura::tools {

/// Base of such verbs.
class CallingVerb : public Verb {
public:
    /// Throws HardwareError in place of the JSON exceptions of work(), whose answers may be of a hostile or
    /// another version of the daemon.
    int run() final;

protected:
    /// `name` has static storage.
    CallingVerb(std::string_view name, DaemonOptions::Has has) : name_(name), has_(has) {}

    /// Declares the options, after the positional arguments of the verb.
    void declare_daemon(host::CommandLine& line) { daemon_.declare(line, has_); }
    [[nodiscard]] std::unique_ptr<host::DaemonCalls> connect(double timeout_s = 90) const {
        return daemon_.connect(name_, timeout_s);
    }
    /// What run() does.
    virtual int work() = 0;

    [[nodiscard]] std::string_view name() const noexcept { return name_; }
    [[nodiscard]] const DaemonOptions& daemon() const noexcept { return daemon_; }

private:
    const std::string_view name_;
    const DaemonOptions::Has has_;
    DaemonOptions daemon_;
};

} // namespace obscura::tools
