// SPDX-License-Identifier: Apache-2.0
#include "models/kinds/look_ups.hpp"

#include <algorithm>

namespace obscura::models {

Value LookUps::value(Graph& graph, const LookUp& wanted) {
    const auto found = std::find_if(list_.begin(), list_.end(), [&](const LookUp& l) {
        return l.texture == wanted.texture && l.group == wanted.group && l.at == wanted.at;
    });
    const auto index = static_cast<std::int32_t>(found - list_.begin());
    if (found == list_.end()) list_.push_back(wanted);
    const std::int32_t first = first_input_ + 4 * index;
    return vector_value(
        {graph.input(first), graph.input(first + 1), graph.input(first + 2), graph.input(first + 3)});
}

LookUpPlaces::LookUpPlaces(const Model& model, Place at, const Graph& graph, const std::vector<LookUp>& list,
                           std::span<const double> uniforms, std::int32_t inputs, const Execution& execution)
    : list_(list) {
    for (const LookUp& read : list_)
        programs_.push_back(read.own_place
                                ? BoundProgram{}
                                : bound_program(model, at, graph, read.at, uniforms, inputs, execution));
}

bool LookUpPlaces::uses_input(std::int32_t input) const noexcept {
    return std::any_of(programs_.begin(), programs_.end(), [&](const BoundProgram& p) {
        return p.program != nullptr && p.program->uses_input(input);
    });
}

} // namespace obscura::models
