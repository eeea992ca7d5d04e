// SPDX-License-Identifier: Apache-2.0
#include "web/live/live_session.hpp"

#include "core/error.hpp"

#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/websocket.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <deque>

namespace obscura::web {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using ErrorCode = beast::error_code;

constexpr std::chrono::seconds token_time{2};
constexpr std::chrono::seconds handshake_time{2}, idle_time{30};
/// Deliveries that wait to be written while further messages of the viewer are read.
constexpr std::size_t max_waiting = 8;
/// Send buffer in the kernel: pictures wait here, where a newer one can take their place.
constexpr int send_bytes = 256 << 10;

/// One viewer, kept alive by its pending operations.
class LiveSession : public std::enable_shared_from_this<LiveSession> {
public:
    LiveSession(Stream stream, std::string address, LiveServices& services, std::shared_ptr<void> keep)
        : socket_(std::move(stream)),
          timer_(socket_.get_executor()),
          address_(std::move(address)),
          services_(services),
          keep_(std::move(keep)) {
        ++services_.viewers;
    }
    ~LiveSession() {
        if (viewer_) services_.pictures->leave(*viewer_);
        --services_.viewers;
    }
    LiveSession(const LiveSession&) = delete;
    LiveSession& operator=(const LiveSession&) = delete;

    void begin(const LiveRequest& request) {
        auto& lowest = beast::get_lowest_layer(socket_);
        lowest.expires_never(); // the WebSocket has time-outs of its own
        ErrorCode ignored;
        lowest.socket().set_option(asio::socket_base::send_buffer_size(send_bytes), ignored);
        websocket::stream_base::timeout times{};
        times.handshake_timeout = handshake_time;
        times.idle_timeout = idle_time;
        times.keep_alive_pings = true; // browsers answer them also in hidden tabs
        socket_.set_option(times);
        socket_.set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
            response.set(http::field::sec_websocket_protocol, live_protocol);
        }));
        socket_.read_message_max(max_viewer_bytes);
        socket_.auto_fragment(false);
        timer_.expires_after(token_time);
        timer_.async_wait([self = shared_from_this()](ErrorCode error) {
            if (!error && !self->viewer_)
                self->refuse("the first message, within 2 s, is {\"token\": TOKEN}");
        });
        socket_.async_accept(request, [self = shared_from_this()](ErrorCode error) {
            if (!error) self->read();
        });
    }

private:
    void read() {
        reading_ = true;
        socket_.async_read(input_, [self = shared_from_this()](ErrorCode error, std::size_t) {
            self->reading_ = false;
            if (error)
                self->timer_.cancel();
            else
                self->take();
        });
    }

    void take() {
        const auto bytes = input_.cdata();
        const std::string text(static_cast<const char*>(bytes.data()), bytes.size());
        input_.consume(input_.size());
        if (ending_) return;
        try {
            if (!socket_.got_text()) throw InputError("messages are text");
            act(viewer_message_of(text));
        } catch (const InputError& error) {
            if (!viewer_) {
                refuse(error.what());
                return;
            }
            write({reason_text("error", error.what()), {}, nullptr});
        }
        if (!ending_ && waiting_.size() < max_waiting) read();
    }

    void act(const ViewerMessage& message) {
        if (!viewer_) {
            if (!message.token) throw InputError("the first message is {\"token\": TOKEN}");
            if (const auto why = services_.refusal(*message.token, address_)) throw InputError(*why);
            timer_.cancel();
            viewer_ = services_.pictures->join(
                [weak = weak_from_this(), executor = socket_.get_executor()](LiveDelivery delivery) {
                    asio::post(executor, [weak, delivery = std::move(delivery)]() mutable {
                        if (const auto self = weak.lock()) self->write(std::move(delivery));
                    });
                });
        } else if (message.view) {
            services_.pictures->view(*viewer_, *message.view);
        } else if (message.ready) {
            // A viewer that says so before a picture has been sent does not get another one for that.
            ready_ = true;
            pass_ready();
        } else {
            throw InputError("the token is known: allowed are view and ready");
        }
    }

    void pass_ready() {
        const bool on_its_way = std::any_of(waiting_.begin(), waiting_.end(),
                                            [](const LiveDelivery& one) { return one.pixels != nullptr; });
        if (!ready_ || on_its_way) return;
        ready_ = false;
        services_.pictures->ready(*viewer_);
    }

    /// Tells why, and ends the connection.
    void refuse(std::string_view why) {
        if (ending_) return;
        timer_.cancel(); // else it would keep the session, and its place among the viewers
        write({reason_text("error", why), {}, nullptr});
        ending_ = true;
    }

    void write(LiveDelivery delivery) {
        if (ending_) return;
        waiting_.push_back(std::move(delivery));
        if (waiting_.size() == 1) write_next();
    }

    void write_next() {
        const LiveDelivery& next = waiting_.front();
        const auto done = [self = shared_from_this()](ErrorCode error, std::size_t bytes) {
            self->services_.figures->sent(bytes);
            if (error) return;
            self->waiting_.pop_front();
            self->pass_ready();
            if (!self->waiting_.empty())
                self->write_next();
            else if (self->ending_)
                self->close();
            if (!self->reading_ && !self->ending_ && self->waiting_.size() < max_waiting) self->read();
        };
        if (next.pixels) {
            socket_.binary(true);
            socket_.async_write(std::array<asio::const_buffer, 2>{asio::buffer(next.header),
                                                                  next.jpeg ? asio::buffer(*next.jpeg)
                                                                            : asio::buffer(*next.pixels)},
                                done);
        } else {
            socket_.text(true);
            socket_.async_write(asio::buffer(next.text), done);
        }
    }

    void close() {
        socket_.async_close(websocket::close_code::policy_error, [self = shared_from_this()](ErrorCode) {});
    }

    websocket::stream<Stream, false> socket_;
    asio::steady_timer timer_;
    const std::string address_;
    LiveServices& services_;
    const std::shared_ptr<void> keep_;
    beast::flat_static_buffer<max_viewer_bytes> input_;
    std::optional<LivePictures::ViewerId> viewer_; ///< none: the token has not come
    std::deque<LiveDelivery> waiting_;             ///< the first one is being written
    bool reading_ = false, ending_ = false;
    bool ready_ = false; ///< the viewer has said so, and it is not reported yet
};

} // namespace

bool is_live_upgrade(const LiveRequest& request) {
    if (!websocket::is_upgrade(request)) return false;
    http::token_list protocols{request[http::field::sec_websocket_protocol]};
    return protocols.exists(beast::string_view(live_protocol.data(), live_protocol.size()));
}

void begin_live_session(Stream stream, const LiveRequest& request, std::string address,
                        LiveServices& services, std::shared_ptr<void> keep) {
    std::make_shared<LiveSession>(std::move(stream), std::move(address), services, std::move(keep))
        ->begin(request);
}

} // namespace obscura::web
