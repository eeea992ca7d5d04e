// SPDX-License-Identifier: Apache-2.0
// Table of the SCPI commands: header, handlers, parameters and help.
#pragma once

#include "instrument/link/camera_link.hpp"
#include "instrument/scpi/header_pattern.hpp"
#include "instrument/scpi/message.hpp"
#include "instrument/scpi/status.hpp"

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::instrument {

class CommandTable;

/// What a command works with: status and camera link of its connection.
struct ScpiContext {
    Status& status;
    CameraLink& link;
    const CommandTable& table;
    const std::string& version;                  ///< of this program
    const std::function<bool()>& ended;          ///< true: do not wait any longer
    std::optional<TriggerResult> last_trigger{}; ///< of this connection
    bool completion_wanted = false;              ///< *OPC while a trigger is pending
};

/// A command that is being done.
struct ScpiCall {
    ScpiContext& context;
    std::span<const Parameter> parameters;
    std::uint32_t camera = 0; ///< from 0
    bool message_available = false;
    const struct Command& command;
};

/// Does a command; the text that a query answers. Throws ScpiError and LinkError.
using ScpiHandler = std::string (*)(const ScpiCall& call);

/// One row of the table.
struct Command {
    std::string_view header;  ///< "[CAMera#:]EXPosure[:TIME]", "*IDN"
    std::string parameters{}; ///< of the command, for people; empty: none
    std::string_view help{};
    ScpiHandler set = nullptr;                   ///< null: there is a query only
    ScpiHandler query = nullptr;                 ///< null: there is no query
    bool changes_camera = false;                 ///< the command, not the query
    std::size_t least = 0, most = 0;             ///< parameters of the command
    std::size_t query_least = 0, query_most = 0; ///< parameters of the query
    std::string_view feature{};                  ///< SFNC name of what a short command sets
    std::string_view query_parameters{};
};

/// The commands with their headers taken apart, made once. Its members are thread-safe.
class CommandTable {
public:
    CommandTable();

    struct Found {
        const Command* command;
        std::uint32_t suffix;
    };
    /// The command of a header with mnemonics in upper case; nullopt: there is none.
    [[nodiscard]] std::optional<Found> find(std::span<const std::string> header, bool common) const;
    [[nodiscard]] std::span<const Command> rows() const noexcept { return rows_; }

private:
    std::vector<Command> rows_;
    std::vector<HeaderPattern> patterns_;
};

/// Rows of the common and status commands, and of those of the camera.
[[nodiscard]] std::vector<Command> status_commands();
[[nodiscard]] std::vector<Command> camera_commands();

/// Takes what is known of the pending trigger into the context, waiting at most so long; an error of it goes
/// into the queue. False: it is still pending.
bool settle_trigger(ScpiContext& context, double wait_s);

/// Waits until the pending trigger has its outcome, or the program ends.
void wait_for_trigger(ScpiContext& context);

/// The number of an error of the call server, and its text.
void report(Status& status, const LinkError& error);

} // namespace obscura::instrument
