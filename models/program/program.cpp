// SPDX-License-Identifier: Apache-2.0
#include "models/program/program.hpp"

#include "core/philox.hpp"

#include <time.h>

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <stdexcept>

namespace obscura::models {
namespace {

constexpr std::size_t at(NodeId id) {
    return static_cast<std::size_t>(id);
}

/// Slots by last use: a slot is free for the result of the instruction that reads it last.
class SlotAllocator {
public:
    std::int32_t take() {
        if (free_.empty()) return count_++;
        const std::int32_t slot = free_.back();
        free_.pop_back();
        return slot;
    }
    void give_back(std::int32_t slot) { free_.push_back(slot); }
    [[nodiscard]] std::int32_t count() const { return count_; }

private:
    std::vector<std::int32_t> free_;
    std::int32_t count_ = 0;
};

} // namespace

Program::Program(const Graph& graph, std::span<const NodeId> outputs) {
    const std::vector<Node>& nodes = graph.nodes();
    const std::vector<bool> needed = needed_nodes(graph, outputs);
    std::vector<std::size_t> last_use(nodes.size(), 0);
    for (std::size_t i = 0; i < nodes.size(); ++i)
        if (needed[i])
            for (const NodeId operand : nodes[i].operands)
                if (operand >= 0) last_use[at(operand)] = i;
    for (const NodeId id : outputs)
        last_use[at(id)] = nodes.size();

    SlotAllocator slots;
    std::vector<Operand> places(nodes.size());
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        if (!needed[i]) continue;
        const Node& node = nodes[i];
        if (node.operation == Operation::input) {
            places[i] = {Operand::Kind::input, node.index};
            continue;
        }
        const bool varies = std::any_of(node.operands.begin(), node.operands.end(), [&](NodeId operand) {
            return operand >= 0 && places[at(operand)].kind != Operand::Kind::uniform;
        });
        if (!varies) {
            Node copy = node;
            for (NodeId& operand : copy.operands)
                if (operand >= 0) operand = places[at(operand)].index;
            places[i] = {Operand::Kind::uniform, static_cast<std::int32_t>(uniform_nodes_.size())};
            uniform_nodes_.push_back(copy);
            continue;
        }
        Instruction instruction;
        instruction.operation = node.operation;
        for (std::size_t k = 0; k < node.operands.size(); ++k) {
            if (node.operands[k] < 0) continue;
            const std::size_t operand = at(node.operands[k]);
            instruction.operands[k] = places[operand];
            const bool repeated = std::find(node.operands.begin(), node.operands.begin() + k,
                                            node.operands[k]) != node.operands.begin() + k;
            if (places[operand].kind == Operand::Kind::slot && last_use[operand] == i && !repeated)
                slots.give_back(places[operand].index);
        }
        instruction.slot = slots.take();
        places[i] = {Operand::Kind::slot, instruction.slot};
        instructions_.push_back(instruction);
    }
    slots_ = slots.count();
    if (static_cast<std::size_t>(slots_) > max_slots)
        throw std::length_error("more than 512 values in use at once");
    for (const NodeId id : outputs)
        outputs_.push_back(places[at(id)]);
}

Uniforms Program::bind(std::span<const double> uniforms) const {
    Uniforms bound;
    bound.values_.reserve(uniform_nodes_.size());
    const auto value = [&](NodeId index) { return index >= 0 ? bound.values_[at(index)] : 0; };
    for (const Node& node : uniform_nodes_) {
        if (node.operation == Operation::constant)
            bound.values_.push_back(node.value);
        else if (node.operation == Operation::uniform)
            bound.values_.push_back(uniforms[at(node.index)]);
        else
            bound.values_.push_back(result_of(node.operation, value(node.operands[0]),
                                              value(node.operands[1]), value(node.operands[2])));
    }
    if (native_ != nullptr)
        for (const double number : bound.values_)
            bound.copies_.emplace_back(number);
    return bound;
}

void Program::run(const Uniforms& uniforms, const double* const* inputs, double* const* outputs,
                  std::size_t lanes) const noexcept {
    // Uniforms that were bound before have no copies.
    if (native_ != nullptr && uniforms.copies_.size() == uniforms.values_.size())
        return native_->run(uniforms.copies_, inputs, outputs, lanes);
    interpret(uniforms, inputs, outputs, lanes);
}

void Program::make_native(NativeTarget target, std::span<const double> uniforms, std::int32_t inputs,
                          std::string& why) {
    native_ = NativeCode::make(instructions_, outputs_, target, why);
    if (native_ == nullptr) return;
    constexpr std::size_t lanes = 4096;
    constexpr double infinity = std::numeric_limits<double>::infinity();
    constexpr std::array edges{
        0.0, 1.0, -0.0, 1e-310, infinity, -infinity, std::numeric_limits<double>::quiet_NaN(), -1.0};
    std::vector<std::vector<double>> rows(static_cast<std::size_t>(inputs), std::vector<double>(lanes));
    std::vector<const double*> in;
    for (std::uint32_t k = 0; k < rows.size(); ++k) {
        for (std::uint32_t i = 0; i < lanes; ++i) {
            const auto words = philox4x32({i, k, 0, 0}, philox_key(3));
            // Half of the lanes are as in use, from 0 to 1; the others from -4 to 4, and now and then an
            // edge.
            const double wide =
                words[1] % 8 == 0 ? edges[words[2] % edges.size()] : 8 * uniform_double(words[0]) - 4;
            rows[k][i] = i % 2 == 0 ? uniform_double(words[0]) : wide;
        }
        in.push_back(rows[k].data());
    }
    const Uniforms bound = bind(uniforms);
    std::vector<std::vector<double>> expected(outputs_.size(), std::vector<double>(lanes)), given = expected;
    std::vector<double*> to_expected, to_given;
    for (std::size_t k = 0; k < outputs_.size(); ++k) {
        to_expected.push_back(expected[k].data());
        to_given.push_back(given[k].data());
    }
    interpret(bound, in.data(), to_expected.data(), lanes);
    native_->run(bound.copies_, in.data(), to_given.data(), lanes);
    for (std::size_t k = 0; k < outputs_.size(); ++k)
        for (std::size_t i = 0; i < lanes; ++i) {
            const double a = expected[k][i], b = given[k][i];
            const bool both_none = a != a && b != b;
            if (both_none || std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b)) continue;
            why = "machine code and interpreter differ";
            native_.reset();
            return;
        }
}

void Program::measure(const Uniforms& uniforms, std::int32_t inputs) {
    constexpr std::size_t lanes = 1024;
    constexpr int repeats = 5; // the least of them: other programs only add to it
    const auto processor_ns = [] {
        timespec now{};
        ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
        return 1e9 * static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec);
    };
    std::vector<std::vector<double>> in(static_cast<std::size_t>(inputs), std::vector<double>(lanes));
    std::vector<std::vector<double>> out(outputs_.size(), std::vector<double>(lanes));
    std::vector<const double*> from;
    std::vector<double*> to;
    for (auto& row : in)
        from.push_back(row.data());
    for (auto& row : out)
        to.push_back(row.data());
    measured_ns_ = 0;
    for (const auto& [offset, scale] : {std::pair{0.0, 1.0}, {-4.0, 8.0}, {0.0, 1e-3}, {-1e3, 2e3}}) {
        for (std::uint32_t k = 0; k < in.size(); ++k)
            for (std::uint32_t i = 0; i < lanes; ++i)
                in[k][i] = offset + scale * uniform_double(philox4x32({i, k, 1, 0}, philox_key(3))[0]);
        double least = std::numeric_limits<double>::infinity();
        for (int repeat = 0; repeat < repeats; ++repeat) {
            const double before = processor_ns();
            run(uniforms, from.data(), to.data(), lanes);
            least = std::min(least, processor_ns() - before);
        }
        measured_ns_ = std::max(measured_ns_, least / lanes);
    }
}

bool Program::uses_input(std::int32_t index) const noexcept {
    const auto reads = [&](const Operand& o) { return o.kind == Operand::Kind::input && o.index == index; };
    return std::any_of(outputs_.begin(), outputs_.end(), reads) ||
           std::any_of(instructions_.begin(), instructions_.end(), [&](const Instruction& i) {
               const auto end = i.operands.begin() + row_of(i.operation).operands;
               return std::any_of(i.operands.begin(), end, reads);
           });
}

} // namespace obscura::models
