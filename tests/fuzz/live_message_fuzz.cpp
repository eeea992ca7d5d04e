// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: a message of a viewer of live pictures, the view that it asks for, and its share of the
// budget. Whatever a message holds, it is read or refused in one line; a view that was read is made of an
// image of any size, and has the pixels that a plain loop finds.
//
// Input: width and height of the image, less one, then the message.
#include "core/error.hpp"
#include "tests/fuzz/scratch_folder.hpp"
#include "web/live/live_budget.hpp"
#include "web/live/live_message.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

using namespace obscura;
using namespace obscura::web;
using test::require;

namespace {

std::optional<ViewerMessage> message_of(std::string_view text) {
    try {
        return viewer_message_of(text);
    } catch (const InputError& error) {
        const std::string_view why = error.what();
        require(!why.empty() && why.find('\n') == std::string_view::npos);
    }
    return std::nullopt;
}

/// The number of a bin, pixel by pixel.
std::uint16_t bin_of(const std::vector<std::uint16_t>& image, std::uint32_t width, const View& view,
                     std::uint32_t column, std::uint32_t row) {
    const std::uint32_t left = column * view.bin, top = row * view.bin;
    const std::uint32_t right = std::min(left + view.bin, view.width),
                        end = std::min(top + view.bin, view.height);
    std::uint64_t most = 0, sum = 0, count = 0;
    for (std::uint32_t y = top; y < end; ++y)
        for (std::uint32_t x = left; x < right; ++x, ++count) {
            const std::uint16_t dn = image[(view.y + y) * width + view.x + x];
            most = std::max<std::uint64_t>(most, dn);
            sum += dn;
        }
    return static_cast<std::uint16_t>(view.reduce == Reduce::max ? most : (sum + count / 2) / count);
}

void make_view(const View& asked, std::uint32_t width, std::uint32_t height) {
    const View view = clipped(asked, width, height);
    require(view.width >= 1 && view.x + view.width <= width);
    require(view.height >= 1 && view.y + view.height <= height);
    std::vector<std::uint16_t> image(std::size_t{width} * height);
    for (std::size_t i = 0; i < image.size(); ++i)
        image[i] = static_cast<std::uint16_t>(i * 40503);
    const std::vector<std::uint16_t> made = reduced(image, width, view);
    require(made.size() == view.columns() * view.rows() && view.bytes() == 2 * made.size());
    std::size_t at = 0;
    for (std::uint32_t row = 0; row < view.rows(); ++row)
        for (std::uint32_t column = 0; column < view.columns(); ++column)
            require(made[at++] == bin_of(image, width, view, column, row));
}

/// What viewers get of the largest image there may be.
void share_budget(const ViewRequest& request) {
    View view = clipped(request.view, View::max_side, View::max_side);
    const std::array wishes{Wish{view, request.max_hz}, Wish{clipped({}, 1, 1), 60},
                            Wish{clipped({}, 4096, 4096), 10}};
    const std::vector<Share> shares = shared_out(wishes, live_bytes_per_s);
    require(shares.size() == wishes.size());
    double bytes_per_s = 0;
    for (std::size_t i = 0; i < shares.size(); ++i) {
        require(shares[i].hz > 0 && shares[i].hz <= wishes[i].hz);
        require(shares[i].view.bin >= wishes[i].view.bin && shares[i].view.bin <= View::max_bin);
        bytes_per_s += shares[i].hz * static_cast<double>(shares[i].view.bytes());
    }
    require(bytes_per_s <= live_bytes_per_s * 1.000001);
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size < 2 || size > 2 + max_viewer_bytes) return 0;
    const std::uint32_t width = 1u + data[0] % 96, height = 1u + data[1] % 96;
    const auto message = message_of({reinterpret_cast<const char*>(data + 2), size - 2});
    if (!message) return 0;
    require((message->token ? 1 : 0) + (message->view ? 1 : 0) + (message->ready ? 1 : 0) == 1);
    if (!message->view) return 0;
    const ViewRequest& request = *message->view;
    require(camera_id_of(to_text(request.camera)) == request.camera);
    require(request.max_hz >= 0.1 && request.max_hz <= ViewRequest::max_request_hz);
    make_view(request.view, width, height);
    share_budget(request);
    return 0;
}
