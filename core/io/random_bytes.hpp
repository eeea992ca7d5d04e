// SPDX-License-Identifier: Apache-2.0
// Random bytes of the kernel, for secrets and seeds.
#pragma once

#include <cstddef>
#include <span>

namespace obscura {

/// Fills `bytes`, at most 256 of them, as getrandom(2) does. Throws HardwareError. Not real-time safe.
void fill_with_random_bytes(std::span<std::byte> bytes);

} // namespace obscura
