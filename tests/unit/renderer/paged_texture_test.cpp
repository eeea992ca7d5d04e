// SPDX-License-Identifier: Apache-2.0
// Giant textures as textures: from memory and tile by tile, against the same raster as an image.
#include "core/error.hpp"
#include "images/writers/fits.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/textures/paged_texture.hpp"
#include "renderer/textures/texture.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/terrain/obt_support.hpp"

#include <chrono>
#include <random>
#include <thread>

namespace paged_texture_test {

using namespace obscura;
using namespace obscura::renderer;
using namespace obscura::test;
using namespace obscura::terrain;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;

namespace {

/// Smooth with grain, 0.1 to 0.9.
float grey(std::uint32_t plane, std::int64_t x, std::int64_t y) {
    const auto u = static_cast<double>(x), v = static_cast<double>(y);
    return static_cast<float>(0.5 + 0.3 * std::sin(u / 40 + plane) * std::cos(v / 23)) +
           0.2F * (noise_at(plane, x, y) - 0.5F);
}

std::filesystem::path write(const TempFolder& folder, ObtMetadata m, FunctionSource::Function f = grey) {
    m.kind = ObtKind::albedo;
    FunctionSource source(std::move(f));
    const auto file = folder.path() / "a.obt";
    (void)write_obt(file, m, source);
    return file;
}

std::vector<float> raster(std::int32_t width, std::int32_t height, std::uint32_t plane = 0) {
    std::vector<float> values;
    for (std::int32_t y = 0; y < height; ++y)
        for (std::int32_t x = 0; x < width; ++x)
            values.push_back(grey(plane, x, y));
    return values;
}

std::shared_ptr<PagedTexture> paged(const std::filesystem::path& file, std::size_t cache_bytes) {
    return std::make_shared<PagedTexture>(std::make_shared<const ObtFile>(file, 0), cache_bytes);
}

struct Lookup {
    double u, v;
    TextureAxis a, b;
};
std::vector<Lookup> lookups(int count, unsigned seed) {
    std::mt19937 random(seed);
    const auto any = [&](double from, double to) {
        return from + (to - from) * static_cast<double>(random() % 100000) / 100000;
    };
    std::vector<Lookup> out;
    for (int k = 0; k < count; ++k) {
        const double size = std::exp2(any(-12, 1)), thin = any(0.02, 1);
        out.push_back({any(-1.5, 1.5),
                       any(-0.2, 1.2),
                       {size * any(-1, 1), size * any(-1, 1)},
                       {size * thin * any(-1, 1), size * thin * any(-1, 1)}});
    }
    return out;
}

std::vector<double> sampled(const Texture& t, const std::vector<Lookup>& at) {
    std::vector<double> out;
    double planes[Texture::max_planes];
    for (const Lookup& l : at) {
        t.sample(l.u, l.v, l.a, l.b, planes);
        out.insert(out.end(), planes, planes + t.planes());
    }
    return out;
}

} // namespace

TEST_CASE("A small giant texture is the same texture as its raster, bit for bit") {
    const TempFolder folder;
    const auto edge = GENERATE(Texture::Edge::repeat, Texture::Edge::clamp);
    ObtMetadata m = planar_metadata(SampleType::f32, 601, 333, 3);
    m.rgb = true;
    const Texture from_obt = read_texture(write(folder, m), TextureCoding::srgb, edge);
    const Texture from_memory(601, 333, {raster(601, 333, 0), raster(601, 333, 1), raster(601, 333, 2)}, edge,
                              true);
    CHECK(from_obt.rgb());
    const std::vector<Lookup> at = lookups(2000, 1);
    CHECK(sampled(from_obt, at) == sampled(from_memory, at));
    CHECK(from_obt.mean(1) == from_memory.mean(1));
    CHECK(from_obt.largest(2) == from_memory.largest(2));
}

TEST_CASE("Tiles in a cache give what the raster in memory gives, within the rounding of the types") {
    const TempFolder folder;
    const auto type =
        GENERATE(SampleType::u8, SampleType::i16, SampleType::u16, SampleType::f16, SampleType::f32);
    const auto edge = GENERATE(Texture::Edge::repeat, Texture::Edge::clamp);
    // Sizes are powers of two, for which both have the same levels.
    ObtMetadata m = planar_metadata(type, 2048, 1024, 2);
    const double codes = type == SampleType::u8 ? 255 : 65535;
    const bool whole = type != SampleType::f16 && type != SampleType::f32;
    if (whole) m.scale = 1 / codes;
    if (type == SampleType::i16) m.offset = 32768 / codes;
    const auto f = [&](std::uint32_t plane, std::int64_t x, std::int64_t y) {
        const auto v = static_cast<double>(grey(plane, x, y));
        return static_cast<float>(whole ? std::round((v - m.offset) / m.scale) : v);
    };
    const auto file = write(folder, m, f);
    const Texture memory(2048, 1024, {raster(2048, 1024, 0), raster(2048, 1024, 1)}, edge);
    const Texture tiles(paged(file, 0), edge); // 16 slots for 43 tiles
    const std::vector<Lookup> at = lookups(3000, 2);
    const std::vector<double> expected = sampled(memory, at), got = sampled(tiles, at);
    // Half a step of the file, half a step of the levels in memory and of the coarser levels.
    const double rounding = whole ? 1.01 / codes : type == SampleType::f16 ? 0x1p-11 : 0;
    for (std::size_t k = 0; k < got.size(); ++k)
        REQUIRE_THAT(got[k], WithinAbs(expected[k], 1.3e-5 + rounding));
    CHECK_THAT(tiles.mean(0), WithinAbs(memory.mean(0), 1e-5 + rounding));
    CHECK_THAT(tiles.least(1), WithinAbs(memory.least(1), 1e-5 + rounding));
    CHECK(tiles.paged()->coarser_lookups() == 0);
    // Another order, another cache: the same numbers.
    std::vector<Lookup> back(at.rbegin(), at.rend());
    const std::vector<double> again = sampled(Texture(paged(file, 64 << 20), edge), back);
    for (std::size_t k = 0; k < at.size(); ++k)
        for (std::size_t p = 0; p < 2; ++p)
            REQUIRE(again[2 * (at.size() - 1 - k) + p] == got[2 * k + p]);
}

TEST_CASE("Levels of odd sizes meet at the seam and keep the mean") {
    const TempFolder folder;
    const Texture tiles(paged(write(folder, planar_metadata(SampleType::f32, 1357, 777)), 0),
                        Texture::Edge::clamp);
    double value[1], other[1];
    for (std::int32_t x = 0; x < 1357; x += 31)
        for (std::int32_t y = 0; y < 777; y += 17) {
            tiles.sample((x + 0.5) / 1357, (y + 0.5) / 777, {}, {}, value);
            REQUIRE_THAT(value[0], WithinAbs(static_cast<double>(grey(0, x, y)), 1e-6));
        }
    for (int level = 0; level < 11; ++level) {
        const TextureAxis a{std::exp2(level) / 1357, 0}, b{0, std::exp2(level) / 777};
        for (double v = 0.03; v < 1; v += 0.09) {
            tiles.sample(1 - 1e-9, v, a, b, value);
            tiles.sample(1e-9, v, a, b, other);
            REQUIRE_THAT(value[0], WithinAbs(other[0], 1e-5));
        }
    }
    double sum = 0;
    for (const float v : raster(1357, 777))
        sum += static_cast<double>(v);
    tiles.sample(0.3, 0.7, {1, 0}, {0, 1}, value);
    CHECK_THAT(value[0], WithinAbs(sum / (1357. * 777.), 2e-3));
    CHECK_THAT(tiles.mean(0), WithinAbs(sum / (1357. * 777.), 1e-6));
}

TEST_CASE("Without waiting look-ups take a coarser level, count it, and later the right one") {
    const TempFolder folder;
    const auto file = write(folder, planar_metadata(SampleType::u16, 2048, 1024),
                            [](auto, std::int64_t x, auto) { return static_cast<float>(x); });
    const auto pages = paged(file, 64 << 20);
    pages->set_waiting(false);
    const Texture tiles(pages, Texture::Edge::clamp);
    double value[1];
    tiles.sample(0.3, 0.4, {}, {}, value);
    const double exact = 0.3 * 2048 - 0.5;
    CHECK_THAT(value[0], WithinAbs(exact, 10)); // of the coarsest level in the file, in memory from the start
    CHECK(pages->coarser_lookups() > 0);
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(120);
    std::uint64_t before = 0;
    do { // until the loader has it
        before = pages->coarser_lookups();
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
        tiles.sample(0.3, 0.4, {}, {}, value);
    } while (pages->coarser_lookups() > before && std::chrono::steady_clock::now() < end);
    CHECK_THAT(value[0], WithinAbs(exact, 1e-9));
    CHECK(pages->coarser_lookups() == before);
}

TEST_CASE("Threads that share a small cache get what one gets") {
    const TempFolder folder;
    const auto file = write(folder, planar_metadata(SampleType::f32, 4096, 1024));
    const Texture alone(paged(file, 64 << 20), Texture::Edge::clamp);
    const Texture shared(paged(file, 0), Texture::Edge::clamp);
    const std::vector<Lookup> at = lookups(600, 3);
    const std::vector<double> expected = sampled(alone, at);
    std::vector<std::thread> threads;
    std::atomic<int> wrong = 0;
    for (int k = 0; k < 4; ++k)
        threads.emplace_back([&] { wrong += sampled(shared, at) == expected ? 0 : 1; });
    for (std::thread& thread : threads)
        thread.join();
    CHECK(wrong == 0);
}

TEST_CASE("Renderers wait for texels, or count what they missed until it is there") {
    const TempFolder folder;
    // 2^26 texels and a row more; grey but for the part about longitude and latitude 0.
    const auto file =
        write(folder, planar_metadata(SampleType::u8, 16384, 4097), [](auto, std::int64_t x, std::int64_t y) {
            const bool there = std::abs(x - 8192) < 500 && std::abs(y - 2048) < 500;
            return there ? static_cast<float>((x / 3 + y / 5) % 2) : 0.F;
        });
    scene::Scene s;
    s.bodies.push_back({"ball", EllipsoidParameters{{1, 1, 1}}, LambertParameters{1}, {}});
    s.bodies[0].textures.albedo = file.string();
    s.sun.position_m = {astronomical_unit_m, 0, 0};
    s.camera = camera_at({50, 0, 0}, 48, 1e-5);
    const std::vector<float> expected = render(Renderer(s, {4, 2, 1})).values;
    const auto [least, most] = std::minmax_element(expected.begin(), expected.end());
    CHECK(*most > 1.5F * *least);
    RenderSettings settings{4, 2, 1};
    settings.wait_for_tiles = false;
    const Renderer now(s, settings);
    std::vector<float> image = render(now).values;
    CHECK(now.work().tiles_missed > 0);
    CHECK(image != expected);
    for (int k = 0; k < 12'000 && image != expected; ++k) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
        image = render(now).values;
    }
    CHECK(image == expected);
}

TEST_CASE("Giant textures that are no textures are refused by name") {
    const TempFolder folder;
    ObtMetadata m = planar_metadata(SampleType::f32, 300, 300);
    auto file = write(folder, m, [](auto, std::int64_t x, auto) {
        return x == 7 ? std::numeric_limits<float>::quiet_NaN() : 1.F + static_cast<float>(x);
    });
    CHECK_THROWS_WITH(read_texture(file, TextureCoding::linear, Texture::Edge::clamp),
                      ContainsSubstring("a.obt: samples of plane 0 are missing: textures need all"));
    CHECK_THROWS_WITH(paged(file, 0), ContainsSubstring("a.obt: samples of plane 0 are missing"));
    m = planar_metadata(SampleType::u16, 300, 300);
    m.lattice = true;
    CHECK_THROWS_WITH(paged(write(folder, m), 0),
                      ContainsSubstring("textures need u8, i16, u16, f16 or f32"));
}

} // namespace paged_texture_test
