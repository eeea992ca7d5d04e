// SPDX-License-Identifier: Apache-2.0
// SCPI conversation of one client: program messages in, response messages out.
#pragma once

#include "instrument/scpi/commands.hpp"

#include <functional>
#include <string>
#include <string_view>

namespace obscura::instrument {

/// Thread-bound. Error queue, event registers and enable registers are the client's own; the camera is
/// everyone's.
class ScpiSession {
public:
    /// `may_change`: false refuses commands that change a camera. `ended`: true ends waiting commands.
    /// All outlive this.
    ScpiSession(const CommandTable& table, CameraLink& link, const std::string& version, bool may_change,
                std::function<bool()> ended);
    ScpiSession(const ScpiSession&) = delete;
    ScpiSession& operator=(const ScpiSession&) = delete;

    /// Does the commands of a line, which comes without its terminator. After a command error (-100 to -199)
    /// the rest of the line is left out. The response message without terminator; empty: none.
    [[nodiscard]] std::string execute(std::string_view line);
    /// A line that was too long was thrown away.
    void overrun() { status_.report(ScpiCode::input_buffer_overrun); }

private:
    /// Does one command. Throws ScpiError and LinkError.
    std::string execute(const ProgramUnit& unit, bool message_available);

    Status status_;
    const bool may_change_;
    const std::function<bool()> ended_;
    ScpiContext context_;
    std::vector<std::string> path_; ///< nodes before those of a header that begins without a colon
};

} // namespace obscura::instrument
