// SPDX-License-Identifier: Apache-2.0
#include "core/philox.hpp"
#include "models/graph/graph.hpp"
#include "models/program/program.hpp"
#include "tests/support/catch.hpp"

#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace program_test {

using namespace obscura;
using namespace obscura::models;

namespace {

/// A graph of random operations on `inputs` inputs and two uniforms.
std::vector<NodeId> random_graph(Graph& graph, std::uint32_t seed, int inputs, int operations) {
    std::vector<NodeId> ids{graph.uniform(0), graph.uniform(1), graph.constant(0.5), graph.constant(0)};
    for (int i = 0; i < inputs; ++i)
        ids.push_back(graph.input(i));
    for (std::uint32_t k = 0; ids.size() < static_cast<std::size_t>(inputs + 4 + operations) && k < 10'000;
         ++k) {
        const auto words = philox4x32({k, 0, 0, 0}, philox_key(seed));
        const auto op = static_cast<Operation>(3 + words[0] % (operation_table.size() - 3));
        const auto pick = [&](std::size_t word) { return ids[words[word] % ids.size()]; };
        const int count = row_of(op).operands;
        ids.push_back(graph.apply(op, pick(1), count > 1 ? pick(2) : -1, count > 2 ? pick(3) : -1));
    }
    return {ids.end() - 3, ids.end()};
}

/// What node `id` is, computed one node after the other without Program.
double value_of(const Graph& graph, NodeId id, const std::vector<double>& uniforms,
                const std::vector<double>& inputs) {
    std::vector<double> values;
    for (const Node& n : graph.nodes()) {
        const auto operand = [&](std::size_t k) {
            return n.operands[k] >= 0 ? values[static_cast<std::size_t>(n.operands[k])] : 0;
        };
        const auto index = static_cast<std::size_t>(n.index);
        if (n.operation == Operation::constant)
            values.push_back(n.value);
        else if (n.operation == Operation::uniform)
            values.push_back(uniforms[index]);
        else if (n.operation == Operation::input)
            values.push_back(inputs[index]);
        else
            values.push_back(result_of(n.operation, operand(0), operand(1), operand(2)));
    }
    return values[static_cast<std::size_t>(id)];
}

bool same_bits(double a, double b) {
    return (std::isnan(a) && std::isnan(b)) ||
           std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

} // namespace

TEST_CASE("a program gives the bits of its graph, in blocks of any size", "[models]") {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const std::vector<double> edges{0,         -0.0,         1,   -1,  1e-310, 1e308, infinity,
                                    -infinity, std::nan(""), 0.5, 700, -710};
    const std::vector<double> uniforms{0.3, -1.7};
    for (std::uint32_t seed = 0; seed < 60; ++seed) {
        Graph graph;
        const std::vector<NodeId> outputs = random_graph(graph, seed, 3, 40 + 4 * static_cast<int>(seed));
        Program program(graph, outputs);
        const auto target = static_cast<NativeTarget>(seed % 3);
        std::string why;
        if (target <= native_target()) program.make_native(target, uniforms, 3, why);
        INFO(why);
        CHECK(why != "machine code and interpreter differ");
        const Uniforms bound = program.bind(uniforms);
        for (const std::size_t lanes : {16U, 128U, 304U}) {
            std::vector<std::vector<double>> in(3, std::vector<double>(lanes)), out = in;
            for (std::uint32_t i = 0; i < lanes; ++i)
                for (std::uint32_t k = 0; k < 3; ++k) {
                    const auto words = philox4x32({i, k, 1, 0}, philox_key(seed));
                    in[k][i] =
                        words[0] % 4 == 0 ? edges[words[1] % edges.size()] : 4 * uniform_double(words[2]) - 2;
                }
            const std::vector<const double*> inputs{in[0].data(), in[1].data(), in[2].data()};
            const std::vector<double*> results{out[0].data(), out[1].data(), out[2].data()};
            program.run(bound, inputs.data(), results.data(), lanes);
            int wrong = 0;
            for (std::size_t i = 0; i < lanes; ++i)
                for (std::size_t k = 0; k < outputs.size(); ++k)
                    wrong += same_bits(out[k][i],
                                       value_of(graph, outputs[k], uniforms, {in[0][i], in[1][i], in[2][i]}))
                                 ? 0
                                 : 1;
            INFO("seed " << seed << ", " << lanes << " lanes");
            CHECK(wrong == 0);
        }
    }
}

TEST_CASE("machine code is made where no page may become executable", "[models]") {
    // What systemd's MemoryDenyWriteExecute= forbids, by Linux 6.3's own means.
    constexpr int set_mdwe = 65, refuse_gain = 1;
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) {
        if (prctl(set_mdwe, refuse_gain, 0, 0, 0) != 0) _exit(77);
        void* const page = mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (mprotect(page, 4096, PROT_READ | PROT_EXEC) == 0) _exit(2); // not in force
        Graph graph;
        const NodeId sum = graph.apply(Operation::add, graph.input(0), graph.uniform(0));
        Program program(graph, std::vector{sum});
        std::string why;
        program.make_native(native_target(), std::vector{0.5}, 1, why);
        _exit(program.is_native() ? 0 : 1);
    }
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    REQUIRE(WIFEXITED(status));
    if (WEXITSTATUS(status) == 77 || native_target() == NativeTarget::none)
        WARN("skipped: the kernel has no PR_SET_MDWE, or no machine code can be made");
    else
        CHECK(WEXITSTATUS(status) == 0);
}

TEST_CASE("what depends only on parameters costs nothing for each lane", "[models]") {
    Graph graph;
    NodeId sum = graph.uniform(0);
    for (int i = 0; i < 50; ++i)
        sum = graph.apply(Operation::sine, graph.apply(Operation::add, sum, graph.uniform(1)));
    const NodeId out = graph.apply(Operation::multiply, sum, graph.input(0));
    const Program program(graph, std::vector{out});
    CHECK(program.cost() == 1);
    CHECK(program.uses_input(0));
    CHECK_FALSE(program.uses_input(1));
}

TEST_CASE("a graph has each operation once", "[models]") {
    Graph graph;
    const NodeId a = graph.input(0), b = graph.input(1);
    CHECK(graph.apply(Operation::add, a, b) == graph.apply(Operation::add, b, a));
    CHECK(graph.apply(Operation::subtract, a, b) != graph.apply(Operation::subtract, b, a));
    CHECK(graph.is_constant(graph.apply(Operation::multiply, graph.constant(3), graph.constant(4)), 12));
    CHECK(graph.apply(Operation::select, graph.constant(1), a, b) == a);
    CHECK(graph.apply(Operation::negate, graph.apply(Operation::negate, a)) == a);
}

TEST_CASE("more values in use at once than there is room for are refused", "[models]") {
    Graph graph;
    std::vector<NodeId> ids;
    for (int i = 0; i < 600; ++i)
        ids.push_back(graph.apply(Operation::add, graph.input(0), graph.constant(i + 1)));
    NodeId sum = graph.constant(0);
    for (std::size_t i = ids.size(); i-- > 0;) // the last one first, so that all wait
        sum = graph.apply(Operation::add, sum, graph.apply(Operation::sine, ids[i]));
    CHECK_THROWS_AS(Program(graph, std::vector{sum}), std::length_error);
}

} // namespace program_test
