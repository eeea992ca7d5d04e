// SPDX-License-Identifier: Apache-2.0
// Commands that save the last picture below the output folder.
#include "serve/compatible/door.hpp"
#include "serve/compatible/handlers.hpp"
#include "serve/compatible/picture_file.hpp"
#include "service/failure.hpp"

#include <array>
#include <cstddef>
#include <string_view>
#include <utility>

namespace obscura::serve::compatible {
namespace {

const Picture& saved_picture(const Door& door, std::string_view call) {
    if (door.picture) return *door.picture;
    throw service::bad_argument("filename",
                                std::string(call) + ": there is no picture yet, call render first");
}

PicturePlanes empty_planes(const Door& door, const Picture& picture) {
    return {picture.width, picture.height, {}, door.rendering.irradiance ? "W m-2" : "W m-2 sr-1"};
}

/// The first `count` channels.
PicturePlanes channel_planes(const Door& door, const Picture& picture, std::size_t count) {
    PicturePlanes made = empty_planes(door, picture);
    for (std::size_t k = 0; k < count; ++k) {
        const float* const begin = picture.values.data() + k * picture.pixels();
        made.planes.emplace_back(begin, begin + picture.pixels());
    }
    return made;
}

/// Sum of the channels times weights.
PicturePlanes weighted_plane(const Door& door, const Picture& picture, const Channels& weights) {
    PicturePlanes made = empty_planes(door, picture);
    std::vector<float> sum(picture.pixels());
    for (std::size_t i = 0; i < sum.size(); ++i) {
        double value = 0;
        for (std::size_t k = 0; k < channels; ++k)
            value += weights[k] * static_cast<double>(picture.values[k * sum.size() + i]);
        sum[i] = static_cast<float>(value);
    }
    made.planes.push_back(std::move(sum));
    return made;
}

constexpr Channels gray{1.0 / 3, 1.0 / 3, 1.0 / 3, 0};

Channels spectrum_of(const Arguments& arguments) {
    const std::vector<double> numbers = arguments.vector("spectrum", channels);
    return {numbers[0], numbers[1], numbers[2], numbers[3]};
}

/// A handler that saves what `make` gives of the last picture.
template<typename Make, typename Save>
auto saving(std::string_view call, Make make, Save save) {
    return [=](Request& r) {
        const std::filesystem::path place = r.door.files.place_for(r.arguments.text("filename"));
        save(place, make(r.door, saved_picture(r.door, call), r.arguments), r.arguments);
    };
}

} // namespace

void add_save_calls(Handlers& handlers) {
    const auto floats = [](const std::filesystem::path& file, const PicturePlanes& planes,
                           const Arguments& /*arguments*/) { save_floats(file, planes); };
    const auto bytes = [](const std::filesystem::path& file, const PicturePlanes& planes,
                          const Arguments& /*arguments*/) { save_integers(file, planes, 8); };
    const auto grays = [](const Door& door, const Picture& picture, const Arguments& /*arguments*/) {
        return weighted_plane(door, picture, gray);
    };
    const auto projected = [](const Door& door, const Picture& picture, const Arguments& arguments) {
        return weighted_plane(door, picture, spectrum_of(arguments));
    };
    handlers["saveImage"] = saving(
        "saveImage",
        [](const Door& door, const Picture& picture, const Arguments& /*arguments*/) {
            return channel_planes(door, picture, channels);
        },
        floats);
    handlers["saveImageRGB8"] = saving(
        "saveImageRGB8",
        [](const Door& door, const Picture& picture, const Arguments& /*arguments*/) {
            return channel_planes(door, picture, 3);
        },
        bytes);
    handlers["saveImageGray32F"] = saving("saveImageGray32F", grays, floats);
    handlers["saveImageGray8"] = saving("saveImageGray8", grays, bytes);
    handlers["saveDepthMap"] = [](Request& r) {
        const std::filesystem::path place = r.door.files.place_for(r.arguments.text("filename"));
        const Picture& picture = saved_picture(r.door, r.command.name);
        r.door.find_surfaces(r.work);
        save_floats(place,
                    {picture.width, picture.height, {{picture.range_m.begin(), picture.range_m.end()}}, "m"});
    };
    handlers["saveImageSpectrumProjection"] = saving("saveImageSpectrumProjection", projected, floats);
    handlers["saveImageSpectrumProjectionQuantized"] = saving(
        "saveImageSpectrumProjectionQuantized", projected,
        [](const std::filesystem::path& file, const PicturePlanes& planes, const Arguments& arguments) {
            save_integers(file, planes, static_cast<int>(arguments.integer("nbits", 1, 16)));
        });
}

} // namespace obscura::serve::compatible
