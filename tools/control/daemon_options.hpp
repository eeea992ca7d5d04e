// SPDX-License-Identifier: Apache-2.0
// Options of verbs that call a daemon: which daemon, which camera, and who asks.
#pragma once

#include "host/command_line.hpp"
#include "host/daemon_calls.hpp"
#include "tools/control/url_options.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace obscura::tools {

/// Thread-bound.
class DaemonOptions {
public:
    enum class Has : std::uint8_t { daemon, camera };

    /// Declares the options; `has`: whether the verb is about one camera.
    void declare(host::CommandLine& line, Has has);
    /// Connects as the options say: to an address, else to the only daemon of this machine. Calls may be
    /// silent for `timeout_s`. Throws UsageError, HardwareError, CallError.
    [[nodiscard]] std::unique_ptr<host::DaemonCalls> connect(std::string_view verb,
                                                             double timeout_s = 90) const;

    /// Fields of a call about the chosen camera.
    [[nodiscard]] host::CallJson fields() const { return {{"camera", camera_}}; }
    [[nodiscard]] std::uint32_t camera() const noexcept { return camera_; }
    [[nodiscard]] const std::string& socket() const noexcept { return socket_; }
    /// The daemon is asked through obscura-web.
    [[nodiscard]] bool over_web() const noexcept { return url_.given(); }

private:
    [[nodiscard]] std::string control_address(std::string_view verb) const;

    std::string socket_, control_;
    UrlOptions url_;
    std::uint32_t camera_ = 0;
};

/// One line for a call that a daemon did not do: the verb in front instead of the call, its hint as a verb.
[[nodiscard]] std::string refusal_line(std::string_view verb, std::string_view call, std::string message,
                                       std::string_view hint);

} // namespace obscura::tools
