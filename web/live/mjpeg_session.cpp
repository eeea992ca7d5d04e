// SPDX-License-Identifier: Apache-2.0
#include "web/live/mjpeg_session.hpp"

#include "web/live/web_figures.hpp"

#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>
#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <utility>

namespace obscura::web {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
using ErrorCode = beast::error_code;

constexpr double max_player_hz = 5;
constexpr std::uint32_t max_side = 512;
constexpr std::chrono::seconds write_time{10};

/// One player, kept alive by its pending operations.
class MjpegSession : public std::enable_shared_from_this<MjpegSession> {
public:
    MjpegSession(Stream stream, LiveServices& services, std::shared_ptr<void> keep)
        : stream_(std::move(stream)), services_(services), keep_(std::move(keep)) {
        ++services_.viewers;
    }
    ~MjpegSession() {
        if (viewer_) services_.pictures->leave(*viewer_);
        --services_.viewers;
    }
    MjpegSession(const MjpegSession&) = delete;
    MjpegSession& operator=(const MjpegSession&) = delete;

    void begin(const CameraId& camera) {
        beast::get_lowest_layer(stream_).expires_never();
        viewer_ = services_.pictures->join(
            [weak = weak_from_this(), executor = stream_.get_executor()](LiveDelivery delivery) {
                asio::post(executor, [weak, delivery = std::move(delivery)]() mutable {
                    if (const auto self = weak.lock()) self->take(std::move(delivery));
                });
            });
        ViewRequest request;
        request.camera = camera;
        request.max_hz = max_player_hz;
        request.encoding = PictureEncoding::jpeg;
        request.max_side = max_side;
        request.histogram = false;
        services_.pictures->view(*viewer_, request);
        wait_for_end();
    }

private:
    /// A client that is gone is seen by reading; what it says is left out.
    void wait_for_end() {
        stream_.async_read_some(asio::buffer(input_),
                                [self = shared_from_this()](ErrorCode error, std::size_t) {
                                    if (error)
                                        self->stream_.end();
                                    else
                                        self->wait_for_end();
                                });
    }

    void take(LiveDelivery delivery) {
        if (!delivery.jpeg) {  // a text: the camera has gone
            ErrorCode ignored; // ends wait_for_end()
            auto& socket = beast::get_lowest_layer(stream_).socket();
            socket.shutdown(asio::ip::tcp::socket::shutdown_both, ignored);
            return;
        }
        std::uint64_t frame = 0; // little-endian as this machine, as all of the project's
        std::memcpy(&frame, delivery.header.data() + 16, sizeof frame);
        head_ = fmt::format(
            "--picture\r\nContent-Type: image/jpeg\r\nContent-Length: {}\r\nX-Obscura-Frame: {}\r\n\r\n",
            delivery.jpeg->size(), frame);
        jpeg_ = std::move(delivery.jpeg);
        beast::get_lowest_layer(stream_).expires_after(write_time);
        asio::async_write(stream_,
                          std::array<asio::const_buffer, 3>{asio::buffer(head_), asio::buffer(*jpeg_),
                                                            asio::buffer("\r\n", 2)},
                          [self = shared_from_this()](ErrorCode error, std::size_t bytes) {
                              self->services_.figures->sent(bytes);
                              if (error) return;
                              beast::get_lowest_layer(self->stream_).expires_never();
                              self->services_.pictures->ready(*self->viewer_);
                          });
    }

    Stream stream_;
    LiveServices& services_;
    const std::shared_ptr<void> keep_;
    std::array<char, 256> input_{};
    std::optional<LivePictures::ViewerId> viewer_;
    std::string head_;
    std::shared_ptr<const std::vector<unsigned char>> jpeg_; ///< that is being written
};

} // namespace

void begin_mjpeg_session(Stream stream, const CameraId& camera, LiveServices& services,
                         std::shared_ptr<void> keep) {
    std::make_shared<MjpegSession>(std::move(stream), services, std::move(keep))->begin(camera);
}

} // namespace obscura::web
