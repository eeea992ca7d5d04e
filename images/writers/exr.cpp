// SPDX-License-Identifier: Apache-2.0
#include "images/writers/exr.hpp"

#include "core/io/input_file.hpp"
#include "images/writers/pending_file.hpp"

#include <ImfChannelList.h>
#include <ImfDoubleAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <stdexcept>

namespace obscura::images {
namespace {

/// Output of OpenEXR whose end can fail. Imf::OutputFile writes its last bytes in a destructor, which keeps
/// errors to itself: on a full disk its own streams leave a file that is cut short and report success.
class CheckedStream final : public Imf::OStream {
public:
    explicit CheckedStream(const std::filesystem::path& file)
        : Imf::OStream(file.c_str()), out_(std::fopen(file.c_str(), "wbe")) {
        if (!out_) throw std::runtime_error(std::strerror(errno));
    }
    // NOLINTNEXTLINE(modernize-avoid-c-arrays): the base class's signature
    void write(const char bytes[], int n) override {
        if (std::fwrite(bytes, 1, static_cast<std::size_t>(n), out_.get()) != static_cast<std::size_t>(n))
            fail();
    }
    std::uint64_t tellp() override { return static_cast<std::uint64_t>(std::ftell(out_.get())); }
    void seekp(std::uint64_t place) override {
        if (std::fseek(out_.get(), static_cast<long>(place), SEEK_SET) != 0) fail();
    }
    /// Throws what went wrong since the beginning.
    void finish() {
        if (std::fclose(out_.release()) != 0) fail();
        if (error_ != 0) throw std::runtime_error(std::strerror(error_));
    }

private:
    [[noreturn]] void fail() {
        if (error_ == 0) error_ = errno;
        throw std::runtime_error(std::strerror(error_));
    }

    std::unique_ptr<std::FILE, CloseFile> out_;
    int error_ = 0;
};

} // namespace

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
        CheckedStream stream(pending.path());
        {
            Imf::OutputFile out(stream, header);
            out.setFrameBuffer(buffer);
            out.writePixels(height);
        }
        stream.finish();
    } catch (const std::exception& error) {
        pending.fail(error.what());
    }
    pending.commit();
}

} // namespace obscura::images
