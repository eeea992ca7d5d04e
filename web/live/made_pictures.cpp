// SPDX-License-Identifier: Apache-2.0
#include "web/live/made_pictures.hpp"

#include "web/live/jpeg.hpp"

#include <algorithm>

namespace obscura::web {

MadePicture MadePictures::picture(const transports::RingFrame& frame, const View& view, bool jpeg) {
    if (serial_ != frame.serial) clear();
    serial_ = frame.serial;
    auto made =
        std::find_if(made_.begin(), made_.end(), [&view](const MadePicture& m) { return m.view == view; });
    if (made == made_.end()) {
        made_.push_back({view, std::make_shared<const std::vector<std::uint16_t>>(
                                   reduced(frame.pixels, frame.header.width, view))});
        made = made_.end() - 1;
    }
    if (jpeg && !made->jpeg) {
        if (levels_.empty())
            levels_ = preview_levels(frame.pixels, std::clamp(frame.header.bits, 8U, 16U), counts_);
        std::vector<unsigned char> bytes = jpeg_of(*made->pixels, view.rows(), levels_);
        if (!bytes.empty()) made->jpeg = std::make_shared<const std::vector<unsigned char>>(std::move(bytes));
    }
    return {view, made->pixels, jpeg ? made->jpeg : nullptr};
}

void MadePictures::clear() {
    made_.clear();
    levels_.clear();
}

} // namespace obscura::web
