// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: a scattering law in SuMoL, from its text to values. It is refused with a line for each
// mistake, or runs, and gives the same numbers in blocks of any size.
#include "core/error.hpp"
#include "models/kinds/material_checks.hpp"
#include "models/model/model.hpp"
#include "tests/fuzz/scratch_folder.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

using namespace obscura;
using test::require;

namespace {

bool same(double a, double b) {
    return (std::isnan(a) && std::isnan(b)) ||
           std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

void evaluate(const models::MaterialProgram& law) {
    constexpr std::size_t lanes = 144;
    std::array<std::vector<double>, 4> rows;
    for (std::size_t i = 0; i < lanes; ++i) {
        rows[0].push_back(static_cast<double>(i) / lanes);
        rows[1].push_back(1 - static_cast<double>(i * 7 % lanes) / lanes);
        rows[2].push_back(rows[0][i] * rows[1][i]);
        rows[3].push_back(0.5);
    }
    const std::vector<const double*> given(law.rows(), rows[3].data());
    std::vector<std::vector<double>> all(law.outputs(), std::vector<double>(lanes)), parts = all;
    const auto starts = [&](std::vector<std::vector<double>>& r, std::size_t first) {
        std::vector<double*> out;
        for (std::vector<double>& row : r)
            out.push_back(row.data() + first);
        return out;
    };
    law.evaluate(rows[0].data(), rows[1].data(), rows[2].data(), given.data(), starts(all, 0).data(), lanes);
    for (std::size_t i = 0; i < lanes; i += models::Program::lane_step)
        law.evaluate(&rows[0][i], &rows[1][i], &rows[2][i], given.data(), starts(parts, i).data(),
                     models::Program::lane_step);
    for (std::size_t c = 0; c < all.size(); ++c)
        for (std::size_t i = 0; i < lanes; ++i)
            require(same(all[c][i], parts[c][i]));
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string text(reinterpret_cast<const char*>(data), size);
    try {
        const auto model = models::Model::parse("m.brdf", text);
        models::MaterialParameters parameters{models::default_parameters(*model)};
        parameters.bands = 6;
        evaluate(models::MaterialProgram(model, parameters));
        for (std::size_t i = 0; i < model->parameters().size() && i < models::MaterialProgram::max_varied;
             ++i)
            if (model->parameters()[i].type != models::Type::vec2 &&
                model->parameters()[i].type != models::Type::vec3 &&
                model->parameters()[i].type != models::Type::texture)
                parameters.varied.push_back(i);
        evaluate(models::MaterialProgram(model, parameters));
    } catch (const ConfigError& error) {
        const std::string what = error.what();
        require(what.starts_with("m.brdf:"));
        for (const char c : what)
            require(c == '\n' || static_cast<unsigned char>(c) >= 0x20);
    }
    return 0;
}
