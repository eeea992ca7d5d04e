// SPDX-License-Identifier: Apache-2.0
// Links of running web servers, which `obscura web` prints: each server holds its file locked while it runs.
#pragma once

#include <string>
#include <vector>

namespace obscura::host {

/// Links of the web servers of this user that run, in order of their processes.
[[nodiscard]] std::vector<std::string> web_links();

/// Removes the files of servers of this user that have gone, as after SIGKILL.
void remove_left_over_web_links();

} // namespace obscura::host
