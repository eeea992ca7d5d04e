// SPDX-License-Identifier: Apache-2.0
// A session of the published client without its connection, and light and numbers of its answers.
#pragma once

#include "serve/compatible/compatible_host.hpp"
#include "serve/compatible/packed_bytes.hpp"
#include "service/failure.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <atomic>
#include <cstring>
#include <fstream>
#include <memory>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::test {

using namespace service::compatible;
using service::Failure;
using service::Work;

constexpr double pi = std::numbers::pi;
constexpr double au_m = 149'597'870'700.0;

class Unhurried final : public Work {
public:
    [[nodiscard]] const std::atomic<bool>& cancelled() const noexcept override { return never_; }
    void progress(std::uint64_t /*done*/, std::uint64_t /*total*/) override {}

private:
    std::atomic<bool> never_{false};
};

/// A session as its connection uses it.
class Client {
public:
    Client()
        : host_(serve::compatible::CompatibleSettings{"test", folder.path(), folder.path(), {}}),
          session_(host_.open(memory)) {}

    Reply call(const char* name, const Fields& arguments = {}) {
        const Command* const command = find_command(name);
        REQUIRE(command != nullptr);
        Reply reply;
        session_->run(*command, Arguments(*command, arguments), work_, reply);
        return reply;
    }
    Value ask(const char* name, const char* result, const Fields& arguments = {}) {
        const Reply reply = call(name, arguments);
        const Value* const value = find(reply.fields, result);
        REQUIRE(value != nullptr);
        return *value;
    }
    void refuse(const char* name, const Fields& arguments, const char* what) {
        try {
            (void)call(name, arguments);
            FAIL("was not refused: " << name);
        } catch (const Failure& failure) {
            CHECK_THAT(failure.what(), Catch::Matchers::ContainsSubstring(what));
            CHECK_THAT(failure.what(), Catch::Matchers::StartsWith(name));
        }
    }
    template<typename Number = float>
    std::vector<Number> numbers(const char* name, const Fields& arguments = {}) {
        const Reply reply = call(name, arguments);
        const bool packed = *find(reply.fields, "compressed")->as<bool>();
        const std::string data = packed ? serve::inflate_packed(reply.body, 1 << 28) : reply.body;
        std::vector<Number> all(data.size() / sizeof(Number));
        std::memcpy(all.data(), data.data(), all.size() * sizeof(Number));
        return all;
    }

    /// A file that the client may name.
    void write(const char* name, std::string_view text) {
        std::ofstream(folder.path() / name, std::ios::binary) << text;
    }
    void place(const char* object, Vec3 at) {
        call("setObjectPosition", {{"object_name", object}, {"pos", List{at.x, at.y, at.z}}});
    }
    void turn(const char* object, const List& q) {
        call("setObjectAttitude", {{"object_name", object}, {"attitude", q}});
    }
    void size(std::int32_t width, std::int32_t height) {
        call("setImageSize", {{"width", width}, {"height", height}});
    }
    void fov_deg(double x, double y) { call("setCameraFOVDeg", {{"fov_x", x}, {"fov_y", y}}); }
    void samples(std::int32_t n) { call("setNbSamplesPerPixel", {{"nb_samples", n}}); }
    void irradiance(bool on) { call("enableIrradianceMode", {{"enable", on}}); }
    /// A white sphere.
    void ball(const char* name, double radius_m, Vec3 at) {
        call("createBRDF", {{"name", "mate"}, {"filename", "mate.brdf"}, {"parameters", Fields{}}});
        call("createShape",
             {{"name", name}, {"filename", "sphere.shp"}, {"parameters", Fields{{"radius", radius_m}}}});
        call("createBody",
             {{"body_name", name}, {"shape_name", name}, {"brdf_name", "mate"}, {"textures", List{}}});
        place(name, at);
    }
    void sun(double radius_m, Vec3 at, double w_sr) {
        call("createBRDF", {{"name", "sun"}, {"filename", "sun.brdf"}, {"parameters", Fields{}}});
        call("createShape",
             {{"name", "sun"}, {"filename", "sphere.shp"}, {"parameters", Fields{{"radius", radius_m}}}});
        call("createBody",
             {{"body_name", "sun"}, {"shape_name", "sun"}, {"brdf_name", "sun"}, {"textures", Fields{}}});
        place("sun", at);
        call("setSunPower", {{"sun_color", List{w_sr, w_sr, w_sr, w_sr}}});
    }

    test::TempFolder folder;
    service::MemoryAccount memory{std::uint64_t{256} << 20};

private:
    Unhurried work_;
    serve::compatible::CompatibleHost host_;
    std::unique_ptr<Session> session_;
};

inline List numbers_of(const Value& value) {
    REQUIRE(value.as<List>() != nullptr);
    return *value.as<List>();
}
inline double number_of(const Value& value) {
    double number = 0;
    REQUIRE(to_number(value, number));
    return number;
}

/// Centre of light of a gray picture, bottom row first: column and row of image coordinates whose origin is
/// the upper left corner.
struct Light {
    double column = 0, row = 0, sum = 0;
};
inline Light light_of(const std::vector<float>& gray, std::size_t width) {
    const std::size_t height = gray.size() / width;
    Light light;
    for (std::size_t i = 0; i < gray.size(); ++i) {
        const double v = static_cast<double>(gray[i]);
        light.sum += v;
        light.column += v * (static_cast<double>(i % width) + 0.5);
        light.row += v * (static_cast<double>(height - 1 - i / width) + 0.5);
    }
    light.column /= light.sum;
    light.row /= light.sum;
    return light;
}

} // namespace obscura::test
