#include "transports/file/fits.hpp"

#include "transports/file/pending_file.hpp"

#include <fitsio.h>

#include <array>
#include <cmath>
#include <string>

namespace obscura::transports {
namespace {

class Writer {
public:
    explicit Writer(const std::filesystem::path& file) : pending_(file) {
        // "!" overwrites the empty file that PendingFile made; create_diskfile takes no filters from the
        // name.
        std::filesystem::remove(pending_.path());
        fits_create_diskfile(&fits_, pending_.path().c_str(), &status_);
        check();
    }
    ~Writer() {
        int ignored = 0;
        if (fits_ != nullptr) fits_delete_file(fits_, &ignored);
    }
    Writer(const Writer&) = delete;
    Writer& operator=(const Writer&) = delete;

    void create_image(int type, std::int32_t width, std::int32_t height, std::int32_t planes) {
        std::array<long, 3> size{width, height, planes};
        fits_create_img(fits_, type, planes > 1 ? 3 : 2, size.data(), &status_);
        check();
    }
    void write(const Card& card) {
        const char* comment = card.comment.c_str();
        if (const auto* text = std::get_if<std::string>(&card.value)) {
            fits_write_key_longwarn(fits_, &status_);
            fits_write_key_longstr(fits_, card.key.c_str(), text->c_str(), comment, &status_);
        } else if (const auto* flag = std::get_if<bool>(&card.value)) {
            int value = *flag ? 1 : 0;
            fits_write_key(fits_, TLOGICAL, card.key.c_str(), &value, comment, &status_);
        } else if (const auto* whole = std::get_if<std::int64_t>(&card.value)) {
            LONGLONG value = *whole;
            fits_write_key(fits_, TLONGLONG, card.key.c_str(), &value, comment, &status_);
        } else {
            double value = std::get<double>(card.value);
            // FITS has no NaN among its header values.
            if (std::isfinite(value))
                fits_write_key_dbl(fits_, card.key.c_str(), value, -15, comment, &status_);
        }
        check();
    }
    void write_pixels(int type, std::size_t count, const void* values) {
        // cfitsio does not write through the pointer.
        fits_write_img(fits_, type, 1, static_cast<LONGLONG>(count), const_cast<void*>(values), &status_);
        check();
    }
    void commit() {
        fits_close_file(fits_, &status_);
        fits_ = nullptr;
        check();
        pending_.commit();
    }

private:
    void check() {
        if (status_ == 0) return;
        char text[FLEN_ERRMSG] = {};
        fits_read_errmsg(text);
        if (text[0] == '\0') fits_get_errstatus(status_, text);
        fits_clear_errmsg();
        pending_.fail(text);
    }

    PendingFile pending_;
    fitsfile* fits_ = nullptr;
    int status_ = 0;
};

} // namespace

void write_fits16(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
                  std::span<const std::uint16_t> pixels, const Cards& cards) {
    Writer writer(file);
    writer.create_image(USHORT_IMG, width, height, 1);
    writer.write({"BUNIT", std::string("adu"), "digital numbers"});
    writer.write({"ROWORDER", std::string("TOP-DOWN"), "first row is the top of the image"});
    for (const Card& card : cards)
        writer.write(card);
    writer.write_pixels(TUSHORT, pixels.size(), pixels.data());
    writer.commit();
}

void write_fits_float(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
                      std::int32_t planes, std::span<const float> values, std::string_view unit,
                      const Cards& cards) {
    Writer writer(file);
    writer.create_image(FLOAT_IMG, width, height, planes);
    writer.write({"BUNIT", std::string(unit), "of the pixel values"});
    writer.write({"ROWORDER", std::string("TOP-DOWN"), "first row is the top of the image"});
    for (const Card& card : cards)
        writer.write(card);
    writer.write_pixels(TFLOAT, values.size(), values.data());
    writer.commit();
}

} // namespace obscura::transports
