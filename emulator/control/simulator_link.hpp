// SPDX-License-Identifier: Apache-2.0
// Connection of a control client to the simulator port: poses and steps by the port's own lines.
#pragma once

#include "core/io/file_descriptor.hpp"
#include "service/call.hpp"

#include <functional>
#include <string>

namespace obscura::emulator {

/// So that poses and steps mean the same wherever they come from. Made at the first request. Thread-bound.
class SimulatorLink {
public:
    /// `connect` gives a connection, see SimulatorServer::connect(); empty: there is no simulator port.
    explicit SimulatorLink(std::function<FileDescriptor()> connect) : connect_(std::move(connect)) {}

    /// Sends a line `pose ...`. Throws Failure.
    void pose(const std::string& line, const service::Work& work);
    /// Sends a line `step ...` and returns its answer `frame ...`, which comes when the frame has left.
    /// Throws Failure; a cancelled step is given up.
    [[nodiscard]] std::string step(const std::string& line, const service::Work& work);

private:
    void send(const std::string& line, const service::Work& work);
    [[nodiscard]] std::string receive(const service::Work& work);

    const std::function<FileDescriptor()> connect_;
    FileDescriptor socket_;
    std::string input_;
};

} // namespace obscura::emulator
