// SPDX-License-Identifier: Apache-2.0
#include "emulator/unit/autostart.hpp"

#include "core/realtime/log.hpp"

namespace obscura::emulator {

void Autostart::begin(const std::string& address) {
    const std::lock_guard lock(mutex_);
    begun_ = true;
    address_ = address;
    if (client_.empty())
        camera_.acquisition_start();
    else
        give_way(); // the client was there first
}

void Autostart::end() {
    const std::lock_guard lock(mutex_);
    begun_ = false;
}

void Autostart::control_taken(const std::string& client) {
    const std::lock_guard lock(mutex_);
    client_ = client;
    if (!begun_) return;
    // Abort: the client waits for its answer, and the end of a long exposure may be far away.
    camera_.acquisition_stop(true);
    give_way();
}

void Autostart::control_ended(const std::string& why) {
    const std::lock_guard lock(mutex_);
    client_.clear();
    if (!begun_) return;
    camera_.acquisition_start();
    log_notice("autostart: {}; the daemon's acquisition on {} runs again with the settings of its start", why,
               address_);
}

void Autostart::give_way() {
    log_notice("autostart: client {} has taken control; the daemon's acquisition on {} stops until it leaves",
               client_, address_);
}

} // namespace obscura::emulator
