// SPDX-License-Identifier: Apache-2.0
// Wing pass: maps of the light that the wings of the point spread function scatter.
#pragma once

#include "renderer/passes/pass_request.hpp"
#include "renderer/passes/row_block.hpp"
#include "renderer/passes/row_scheduler.hpp"

#include <atomic>

namespace obscura::renderer {

/// Makes the wings of the request's rows ready; false when cancelled.
bool fill_wings(const RowScheduler& workers, const PassRequest& request, const std::atomic<bool>* cancel,
                RowBlock& rows);

} // namespace obscura::renderer
