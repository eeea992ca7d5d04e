// SPDX-License-Identifier: Apache-2.0
// Background of a published client: star maps.
#pragma once

#include "serve/compatible/handlers.hpp"

namespace obscura::serve::compatible {

/// Reads the star map that the call names. Throws Failure.
void set_background(Request& request);
/// Makes the table of the stars above the threshold.
void write_stars(ClientState& client_state);

} // namespace obscura::serve::compatible
