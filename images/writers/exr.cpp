// SPDX-License-Identifier: Apache-2.0
#include "images/writers/exr.hpp"

#include "images/writers/pending_file.hpp"

#include <ImfChannelList.h>
#include <ImfDoubleAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>

#include <exception>

namespace obscura::images {

void write_exr(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
               const std::vector<ExrChannel>& channels, const Cards& cards) {
    PendingFile pending(file);
    try {
        Imf::Header header(width, height);
        header.compression() = Imf::ZIP_COMPRESSION;
        Imf::FrameBuffer buffer;
        for (const ExrChannel& channel : channels) {
            header.channels().insert(channel.name, Imf::Channel(Imf::FLOAT));
            header.insert(channel.name + ":unit", Imf::StringAttribute(channel.unit));
            // OpenEXR only reads through the pointer when it writes a file.
            auto* base = reinterpret_cast<char*>(const_cast<float*>(channel.values.data()));
            buffer.insert(channel.name, Imf::Slice(Imf::FLOAT, base, sizeof(float),
                                                   sizeof(float) * static_cast<std::size_t>(width)));
        }
        for (const Card& card : cards) {
            // Write integers as text: they may need more than the 32 bits of EXR's int attribute.
            if (const auto* real = std::get_if<double>(&card.value))
                header.insert(card.key, Imf::DoubleAttribute(*real));
            else
                header.insert(card.key, Imf::StringAttribute(card_text(card)));
        }
        Imf::OutputFile out(pending.path().c_str(), header);
        out.setFrameBuffer(buffer);
        out.writePixels(height);
    } catch (const std::exception& error) {
        pending.fail(error.what());
    }
    pending.commit();
}

} // namespace obscura::images
