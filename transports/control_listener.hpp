// SPDX-License-Identifier: Apache-2.0
// Notifications about clients that take control of the camera and give it up.
#pragma once

#include <string>

namespace obscura::transports {

/// Receiver of these notifications; outlives the transport. Called on the transport's control thread, before
/// the client's command is answered.
class ControlListener {
public:
    virtual ~ControlListener() = default;
    /// `client` ("ADDRESS:PORT") has taken control of the camera, which was free before.
    virtual void control_taken(const std::string& client) = 0;
    /// The camera is free again; its settings are those after the start. `why`: "client ADDRESS:PORT has
    /// ...".
    virtual void control_ended(const std::string& why) = 0;
};

} // namespace obscura::transports
