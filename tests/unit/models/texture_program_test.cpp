// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "models/kinds/texture_program.hpp"
#include "tests/support/catch.hpp"

#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace texture_program_test {

using namespace obscura;
using namespace obscura::models;

namespace {

constexpr std::size_t lanes = 256;
using Row = std::array<double, lanes>;

TextureParameters with_images(const Model& model, std::size_t bands, bool grey = true) {
    TextureParameters parameters{default_parameters(model)};
    parameters.bands = bands;
    parameters.images.assign(model.parameters().size() + 1, {64, 32, grey});
    return parameters;
}

/// Outputs for places of all kinds; rows of reads are those of `read`.
std::vector<Row> values(const TextureProgram& texture, const std::vector<Row>& read = {}) {
    std::vector<Row> rows(texture.rows());
    for (std::size_t i = 0; i < lanes; ++i) {
        rows[TextureProgram::row_x][i] = std::fmod(0.61 * static_cast<double>(i), 1.0);
        rows[TextureProgram::row_y][i] = static_cast<double>(i) / lanes;
        rows[TextureProgram::row_z][i] = std::cos(static_cast<double>(i));
        rows[TextureProgram::row_level][i] = 0.1 * static_cast<double>(i % 40);
        rows[TextureProgram::row_sample_m][i] = 2;
    }
    for (std::size_t k = 0; k < read.size(); ++k)
        rows[TextureProgram::first_read_row + k] = read[k];
    std::vector<const double*> starts;
    for (const Row& row : rows)
        starts.push_back(row.data());
    std::vector<Row> out(texture.outputs());
    std::vector<double*> to_out;
    for (Row& row : out)
        to_out.push_back(row.data());
    texture.evaluate(starts.data(), to_out.data(), lanes);
    return out;
}

std::string refused(const std::string& text) {
    try {
        const auto model = Model::parse("t.txr", text);
        const TextureProgram texture(model, TextureParameters{default_parameters(*model)});
        return "";
    } catch (const ConfigError& error) {
        return error.what();
    }
}

} // namespace

TEST_CASE("a texture is a function of place and level", "[models]") {
    const auto model = Model::parse(
        "t.txr",
        "parameter c vec4(1, 2, 3, 4);\n"
        "vec4 lookup2D(texture tex, vec2 uv, scalar lod) { return c * sin(7 * uv.x) * exp(-uv.y) + lod; }");
    const TextureProgram texture(model, with_images(*model, 3));
    const std::vector<Row> out = values(texture);
    REQUIRE(out.size() == 3);
    double most = 0;
    for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t i = 0; i < lanes; ++i) {
            const double u = std::fmod(0.61 * static_cast<double>(i), 1.0),
                         v = static_cast<double>(i) / lanes;
            const double expected = static_cast<double>(c + 1) * std::sin(7 * u) * std::exp(-v) +
                                    0.1 * static_cast<double>(i % 40);
            most = std::max(most, std::abs(out[c][i] - expected));
        }
    CHECK(most < 1e-12);
}

TEST_CASE("reads of a texture have places of their own, and bands", "[models]") {
    const auto model =
        Model::parse("t.txr", "parameter texture other;\n"
                              "vec4 lookup2D(texture tex, vec2 uv, scalar lod)\n"
                              "{ vec4 a = lookupLOD(tex, uv, lod);\n"
                              "  return a + lookupLOD(other, uv / size(other) + a.x, lod + 1); }");
    const TextureProgram six(model, with_images(*model, 6, false));
    // Two images, in two groups of bands; the second place depends on what the first read gave.
    REQUIRE(six.reads().size() == 4);
    CHECK(six.reads()[0].own_place);
    CHECK_FALSE(six.reads()[1].own_place);
    CHECK(six.outputs() == 6);
    const TextureProgram grey(model, with_images(*model, 6));
    CHECK(grey.reads().size() == 2);
    CHECK(grey.outputs() == 1);
    std::vector<Row> rows(grey.rows());
    for (std::size_t k = 0; k < rows.size(); ++k)
        rows[k].fill(0.125 * static_cast<double>(k + 1));
    std::vector<const double*> starts;
    for (const Row& row : rows)
        starts.push_back(row.data());
    std::array<Row, 3> at{};
    const std::array<double*, 3> to_at{at[0].data(), at[1].data(), at[2].data()};
    grey.read_at(1, starts.data(), to_at.data(), lanes);
    const double first = 0.125 * (TextureProgram::first_read_row + 1);
    CHECK(at[0][3] == 0.125 / 64 + first);
    CHECK(at[1][3] == 0.25 / 32 + first);
    CHECK(at[2][3] == 0.125 * (TextureProgram::row_level + 1) + 1);
}

TEST_CASE("a texture by direction has a level and a size of its own", "[models]") {
    const auto model =
        Model::parse("t.txr", "global size_of vec2(300, 200);\n"
                              "vec4 lookup3D(texture tex, vec3 los, scalar lod)\n"
                              "{ return vec4(lod, los.x, los.y, los.z); }\n"
                              "vec2 textureSize() { return size_of; }\n"
                              "scalar compute3DLOD(texture tex, vec3 xyz, scalar sample_size)\n"
                              "{ return log2(sample_size * 8); }");
    const TextureProgram texture(model, TextureParameters{default_parameters(*model)});
    CHECK(texture.by_position());
    CHECK(texture.size() == std::array<double, 2>{300, 200});
    CHECK(std::abs(values(texture)[0][7] - 4) < 1e-12);
}

TEST_CASE("machine code of a texture gives the bits of the interpreter", "[models]") {
    const auto model = Model::parse("t.txr", "vec4 lookup2D(texture tex, vec2 uv, scalar lod)\n"
                                             "{ vec4 a = lookupLOD(tex, uv * 3 - 1, lod);\n"
                                             "  if (uv.x > 0.9) return vec4(M_NAN);\n"
                                             "  return a * pow(uv.y + 0.1, a.y) + vec4(uv, lod, 1); }");
    TextureParameters parameters = with_images(*model, 4, false);
    std::vector<Row> read(4);
    for (std::size_t k = 0; k < 4; ++k)
        for (std::size_t i = 0; i < lanes; ++i)
            read[k][i] = std::cos(static_cast<double>(i * (k + 1)));
    parameters.target = NativeTarget::none;
    const std::vector<Row> expected = values(TextureProgram(model, parameters), read);
    for (const NativeTarget target : {NativeTarget::avx2, NativeTarget::avx512}) {
        if (target > native_target()) continue;
        parameters.target = target;
        const TextureProgram native(model, parameters);
        CHECK(native.why_interpreted() == "");
        const std::vector<Row> given = values(native, read);
        for (std::size_t c = 0; c < 4; ++c)
            for (std::size_t i = 0; i < lanes; ++i)
                CHECK((given[c][i] == expected[c][i] ||
                       (std::isnan(given[c][i]) && std::isnan(expected[c][i]))));
    }
}

TEST_CASE("the size of a texture does not depend on texels", "[models]") {
    const auto model =
        Model::parse("t.txr", "parameter texture a;\n"
                              "vec2 textureSize() { return lookupLOD(a, vec2(0), 0).xy; }\n"
                              "vec4 lookup2D(texture tex, vec2 uv, scalar lod) { return vec4(1); }");
    CHECK_THROWS_WITH(TextureProgram(model, with_images(*model, 1)),
                      "t.txr:2:6: textureSize() must not read an image");
}

TEST_CASE("textures that cannot be used are refused", "[models]") {
    CHECK(refused("scalar f(scalar x) { return x; }").find("a function is missing, one of vec4 lookup2D(") !=
          std::string::npos);
    CHECK(refused("vec4 lookup2D(texture tex, vec3 uv, scalar lod) { return vec4(1); }")
              .find("'lookup2D' must be") != std::string::npos);
    CHECK(refused("vec4 lookup2D(texture tex, vec2 uv, scalar lod) { return lookupLOD(tex, uv, lod); }") ==
          "t.txr:1:58: the image of the texture is missing");
    CHECK(refused("vec4 lookup2D(texture tex, vec2 uv, scalar lod) { return lookupLOD(tex, lod); }")
              .find("lookupLOD() takes texture, vec2, scalar") != std::string::npos);
    CHECK(refused("vec4 lookup2D(texture tex, vec2 uv, scalar lod) { return vec4(uv, lod, 1); }").empty());
}

} // namespace texture_program_test
