// SPDX-License-Identifier: Apache-2.0
// Directions of a grid of image points, for a projection whose text has only point().
#pragma once

#include "models/kinds/projection_program.hpp"

#include <array>
#include <vector>

namespace obscura::models {

/// inverse_point_graph() without steps, and with one.
struct StepPrograms {
    const BoundProgram &stay, &step;
};

/// Fills the nodes of `table`, which are image points, with their directions: from one that falls on the
/// sensor, as near the boresight as there is, on to its neighbours, so that all are of one branch of the
/// function. Nodes that have none get the mean of their neighbours'. Gives whether nodes have one of their
/// own. Not on a real-time thread.
[[nodiscard]] std::vector<bool> fill_directions(StartTable& table, const ProjectionProgram& projection,
                                                const StepPrograms& programs);

/// Gives nodes without a value of their own the mean of their neighbours', unless none has one.
void spread(StartTable& table, std::vector<bool> known);

} // namespace obscura::models
