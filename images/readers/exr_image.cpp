// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "core/text/suggestion.hpp"
#include "images/image.hpp"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <fmt/format.h>

#include <exception>

namespace obscura::images {

bool exr_has_colours(const std::filesystem::path& file) {
    try {
        const Imf::InputFile in(file.c_str());
        const Imf::ChannelList& channels = in.header().channels();
        return channels.findChannel("R") != nullptr && channels.findChannel("G") != nullptr &&
               channels.findChannel("B") != nullptr;
    } catch (const std::exception& error) {
        throw InputError(fmt::format("{}: not readable as OpenEXR: {}", file.string(), error.what()));
    }
}

bool exr_has_channel(const std::filesystem::path& file, const std::string& channel) {
    try {
        return Imf::InputFile(file.c_str()).header().channels().findChannel(channel) != nullptr;
    } catch (const std::exception& error) {
        throw InputError(fmt::format("{}: not readable as OpenEXR: {}", file.string(), error.what()));
    }
}

Image read_exr_image(const std::filesystem::path& file, const std::string& plane) {
    try {
        Imf::InputFile in(file.c_str());
        const Imath::Box2i window = in.header().dataWindow();
        const auto width = std::int64_t{window.max.x} - window.min.x + 1;
        const auto height = std::int64_t{window.max.y} - window.min.y + 1;
        check_image_size(file, width, height);
        std::vector<std::string> names;
        for (auto c = in.header().channels().begin(); c != in.header().channels().end(); ++c)
            names.emplace_back(c.name());
        if (names.empty()) throw InputError(fmt::format("{}: no channels", file.string()));
        std::string name = plane;
        if (in.header().channels().findChannel(plane) == nullptr) {
            if (plane.find_first_not_of("0123456789") != std::string::npos)
                throw InputError(fmt::format("{}: no channel \"{}\", {}", file.string(), plane,
                                             allowed_words(plane, {names.begin(), names.end()})));
            name = names[static_cast<std::size_t>(
                plane_number(file, plane, static_cast<std::int64_t>(names.size())))];
        }
        std::vector<float> values(static_cast<std::size_t>(width * height));
        Imf::FrameBuffer buffer;
        // OpenEXR addresses pixels from the origin of the data window's coordinates.
        char* origin = reinterpret_cast<char*>(values.data() - window.min.x - window.min.y * width);
        buffer.insert(name, Imf::Slice(Imf::FLOAT, origin, sizeof(float),
                                       sizeof(float) * static_cast<std::size_t>(width)));
        in.setFrameBuffer(buffer);
        in.readPixels(window.min.y, window.max.y);
        return {static_cast<std::int32_t>(width), static_cast<std::int32_t>(height),
                std::vector<double>(values.begin(), values.end()), 1};
    } catch (const InputError&) {
        throw;
    } catch (const std::exception& error) {
        throw InputError(fmt::format("{}: not readable as OpenEXR: {}", file.string(), error.what()));
    }
}

} // namespace obscura::images
