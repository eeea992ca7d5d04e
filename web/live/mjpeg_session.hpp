// SPDX-License-Identifier: Apache-2.0
// Pictures of a camera as an endless answer of JPEGs, for players that know no other form
// (multipart/x-mixed-replace).
#pragma once

#include "web/live/live_message.hpp"
#include "web/live/live_session.hpp"
#include "web/server/stream.hpp"

#include <memory>

namespace obscura::web {

/// Takes over a connection whose header of the type "multipart/x-mixed-replace; boundary=picture" has been
/// sent, and sends pictures of at most 512 pixels a side, at most 5 a second, the next one when the one
/// before has been taken. Ends with the client, with the camera, or where the client takes nothing for 10 s.
/// `services` outlives the session; `keep` lives as long as it.
void begin_mjpeg_session(Stream stream, const CameraId& camera, LiveServices& services,
                         std::shared_ptr<void> keep);

} // namespace obscura::web
