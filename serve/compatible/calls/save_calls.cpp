// SPDX-License-Identifier: Apache-2.0
// Commands that save the last picture below the output folder.
#include "serve/compatible/client_state.hpp"
#include "serve/compatible/handlers.hpp"
#include "serve/compatible/picture_file.hpp"
#include "service/failure.hpp"

#include <array>
#include <cstddef>
#include <string_view>
#include <utility>

namespace obscura::serve::compatible {
namespace {

const Picture& saved_picture(const ClientState& client_state, std::string_view call) {
    if (client_state.picture) return *client_state.picture;
    throw service::bad_argument("filename",
                                std::string(call) + ": there is no picture yet, call render first");
}

PicturePlanes empty_planes(const ClientState& client_state, const Picture& picture) {
    return {picture.width, picture.height, {}, client_state.rendering.irradiance ? "W m-2" : "W m-2 sr-1"};
}

/// The first `count` channels.
PicturePlanes channel_planes(const ClientState& client_state, const Picture& picture, std::size_t count) {
    PicturePlanes made = empty_planes(client_state, picture);
    for (std::size_t k = 0; k < count; ++k) {
        const float* const begin = picture.values.data() + k * picture.pixels();
        made.planes.emplace_back(begin, begin + picture.pixels());
    }
    return made;
}

/// Sum of the channels times weights.
PicturePlanes weighted_plane(const ClientState& client_state, const Picture& picture,
                             const Channels& weights) {
    PicturePlanes made = empty_planes(client_state, picture);
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
        const std::filesystem::path place = r.client_state.files.place_for(r.arguments.text("filename"));
        save(place, make(r.client_state, saved_picture(r.client_state, call), r.arguments), r.arguments);
    };
}

} // namespace

void add_save_calls(Handlers& handlers) {
    const auto floats = [](const std::filesystem::path& file, const PicturePlanes& planes,
                           const Arguments& /*arguments*/) { save_floats(file, planes); };
    const auto bytes = [](const std::filesystem::path& file, const PicturePlanes& planes,
                          const Arguments& /*arguments*/) { save_integers(file, planes, 8); };
    const auto grays = [](const ClientState& client_state, const Picture& picture,
                          const Arguments& /*arguments*/) {
        return weighted_plane(client_state, picture, gray);
    };
    const auto projected = [](const ClientState& client_state, const Picture& picture,
                              const Arguments& arguments) {
        return weighted_plane(client_state, picture, spectrum_of(arguments));
    };
    handlers["saveImage"] = saving(
        "saveImage",
        [](const ClientState& client_state, const Picture& picture, const Arguments& /*arguments*/) {
            return channel_planes(client_state, picture, channels);
        },
        floats);
    handlers["saveImageRGB8"] = saving(
        "saveImageRGB8",
        [](const ClientState& client_state, const Picture& picture, const Arguments& /*arguments*/) {
            return channel_planes(client_state, picture, 3);
        },
        bytes);
    handlers["saveImageGray32F"] = saving("saveImageGray32F", grays, floats);
    handlers["saveImageGray8"] = saving("saveImageGray8", grays, bytes);
    handlers["saveDepthMap"] = [](Request& r) {
        const std::filesystem::path place = r.client_state.files.place_for(r.arguments.text("filename"));
        const Picture& picture = saved_picture(r.client_state, r.command.name);
        r.client_state.find_surfaces(r.work);
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
