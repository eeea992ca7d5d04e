// SPDX-License-Identifier: Apache-2.0
// Connection of a client, over TCP or over TLS, as one type: HTTP and WebSocket are compiled once for both.
#pragma once

// Asio of Boost 1.74 needs it included before.
#include <boost/asio/async_result.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/websocket/teardown.hpp>

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>

namespace obscura::web {

/// Certificate and key of the server, TLS 1.2 and later. Shared by its connections.
class Tls {
public:
    /// `certificate`: chain, PEM; `key`: its private key, PEM. Throws ConfigError.
    Tls(const std::string& certificate, const std::string& key);
    ~Tls();
    Tls(const Tls&) = delete;
    Tls& operator=(const Tls&) = delete;

    struct Context;
    [[nodiscard]] Context& context() const noexcept { return *context_; }

private:
    const std::unique_ptr<Context> context_;
};

/// An AsyncStream of Asio. Its operations end by time as next_layer() says. Thread-bound.
class Stream {
public:
    using ErrorCode = boost::beast::error_code;
    using executor_type = boost::beast::tcp_stream::executor_type;
    using next_layer_type = boost::beast::tcp_stream;
    using Handler = std::function<void(ErrorCode, std::size_t)>;

    /// `tls`: null for plain TCP; else outlives the stream.
    Stream(boost::asio::ip::tcp::socket socket, const Tls* tls);

    [[nodiscard]] executor_type get_executor() noexcept { return layers_->tcp().get_executor(); }
    [[nodiscard]] next_layer_type& next_layer() noexcept { return layers_->tcp(); }
    [[nodiscard]] const next_layer_type& next_layer() const noexcept { return layers_->tcp(); }

    /// First operation: the handshake of TLS, none of TCP. A client that speaks plain HTTP to TLS gets one
    /// line that says so, and an error.
    void start(std::function<void(ErrorCode)> done) { layers_->start(std::move(done)); }
    /// Last operation: ends the connection in good order, on its own. With `done` what the client still sends
    /// is read for a second, a megabyte of it at most: unread, it would have the system take back what was
    /// sent last. `done` is called at the end, and keeps what it holds until then.
    void end(std::function<void()> done = {}) { layers_->end(layers_, std::move(done)); }

    template<typename Buffers, typename Token>
    auto async_read_some(const Buffers& buffers, Token&& token) {
        return boost::asio::async_initiate<Token, void(ErrorCode, std::size_t)>(
            [](auto handler, Layers* layers, const Buffers& of) {
                layers->read(List<boost::asio::mutable_buffer>(of), erased(std::move(handler)));
            },
            token, layers_.get(), buffers);
    }
    template<typename Buffers, typename Token>
    auto async_write_some(const Buffers& buffers, Token&& token) {
        return boost::asio::async_initiate<Token, void(ErrorCode, std::size_t)>(
            [](auto handler, Layers* layers, const Buffers& of) {
                layers->write(List<boost::asio::const_buffer>(of), erased(std::move(handler)));
            },
            token, layers_.get(), buffers);
    }

    /// The first buffers of a sequence, itself a sequence: an operation may use less than it is given.
    template<typename Buffer>
    class List {
    public:
        using value_type = Buffer;
        using const_iterator = const Buffer*;
        template<typename Buffers>
        explicit List(const Buffers& buffers) {
            for (auto at = boost::asio::buffer_sequence_begin(buffers);
                 at != boost::asio::buffer_sequence_end(buffers) && count_ < all_.size(); ++at)
                if (Buffer(*at).size() > 0) all_[count_++] = *at;
        }
        [[nodiscard]] const_iterator begin() const noexcept { return all_.data(); }
        [[nodiscard]] const_iterator end() const noexcept { return all_.data() + count_; }

    private:
        std::array<Buffer, 8> all_;
        std::size_t count_ = 0;
    };

private:
    /// What is below, of one kind.
    struct Layers {
        Layers() = default;
        Layers(const Layers&) = delete;
        Layers& operator=(const Layers&) = delete;
        virtual ~Layers() = default;
        virtual boost::beast::tcp_stream& tcp() noexcept = 0;
        virtual void start(std::function<void(ErrorCode)> done) = 0;
        virtual void end(std::shared_ptr<Layers> self, std::function<void()> done) = 0;
        virtual void read(const List<boost::asio::mutable_buffer>& buffers, Handler handler) = 0;
        virtual void write(const List<boost::asio::const_buffer>& buffers, Handler handler) = 0;
    };
    struct Plain;
    struct Secure;
    struct Farewell;

    /// Handlers of Beast can be moved only.
    template<typename Given>
    static Handler erased(Given handler) {
        return [kept = std::make_shared<Given>(std::move(handler))](ErrorCode error, std::size_t bytes) {
            // What it holds may be the last reference to this stream.
            Given now(std::move(*kept));
            now(error, bytes);
        };
    }

    std::shared_ptr<Layers> layers_;
};

/// For websocket::stream<Stream>: how its connection ends.
template<typename Handler>
void async_teardown(boost::beast::role_type role, Stream& stream, Handler&& handler) {
    boost::beast::websocket::async_teardown(role, stream.next_layer().socket(),
                                            std::forward<Handler>(handler));
}
inline void teardown(boost::beast::role_type role, Stream& stream, Stream::ErrorCode& error) {
    boost::beast::websocket::teardown(role, stream.next_layer().socket(), error);
}

} // namespace obscura::web
