// SPDX-License-Identifier: Apache-2.0
#include "web/server/stream.hpp"

#include "core/error.hpp"

#include <boost/asio/post.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/detect_ssl.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <string_view>

namespace obscura::web {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace ssl = asio::ssl;
using tcp = asio::ip::tcp;
using ErrorCode = beast::error_code;

/// For the handshake, and for the farewell.
constexpr std::chrono::seconds tls_handshake_time{5}, linger_timeout{1};
constexpr std::size_t max_drained_bytes = std::size_t{1} << 20;

constexpr std::string_view not_tls = "HTTP/1.1 400 Bad Request\r\n"
                                     "Content-Type: text/plain; charset=utf-8\r\n"
                                     "Connection: close\r\n"
                                     "\r\n"
                                     "this port speaks HTTPS: the link begins with https://\n";

} // namespace

struct Tls::Context {
    ssl::context ssl{ssl::context::tls_server};
};

Tls::Tls(const std::string& certificate, const std::string& key) : context_(std::make_unique<Context>()) {
    ssl::context& made = context_->ssl;
    ErrorCode error;
    const auto refuse = [&](const std::string& file, const std::string& wanted) {
        if (!error) return;
        const std::string why = std::ifstream(file) ? error.message() : std::strerror(errno);
        throw ConfigError(fmt::format("{}: {}; {} is wanted", file, why, wanted));
    };
    ::SSL_CTX_set_min_proto_version(made.native_handle(), TLS1_2_VERSION);
    ::SSL_CTX_set_options(made.native_handle(), SSL_OP_NO_RENEGOTIATION);
    made.use_certificate_chain_file(certificate, error);
    refuse(certificate, "a certificate in PEM");
    // Refuses also the key of another certificate.
    made.use_private_key_file(key, ssl::context::pem, error);
    refuse(key, fmt::format("the private key of {} in PEM", certificate));
}

Tls::~Tls() = default;

/// Reads what still comes over TCP until the client has ended, or that is too much or takes too long.
struct Stream::Farewell : std::enable_shared_from_this<Farewell> {
    Farewell(std::shared_ptr<Layers> of, std::function<void()> then)
        : layers(std::move(of)), done(std::move(then)) {}

    /// The time has been set.
    void begin() {
        ErrorCode ignored;
        if (!done) return end();
        layers->tcp().socket().shutdown(tcp::socket::shutdown_send, ignored);
        read();
    }
    void read() {
        layers->tcp().async_read_some(asio::buffer(dropped),
                                      [self = shared_from_this()](ErrorCode error, std::size_t bytes) {
                                          self->left -= std::min(bytes, self->left);
                                          if (!error && self->left > 0)
                                              self->read();
                                          else
                                              self->end();
                                      });
    }
    void end() const {
        ErrorCode ignored;
        layers->tcp().socket().shutdown(tcp::socket::shutdown_both, ignored);
        if (done) done();
    }

    const std::shared_ptr<Layers> layers;
    const std::function<void()> done;
    std::array<char, 16384> dropped{};
    std::size_t left = max_drained_bytes;
};

/// TCP alone.
struct Stream::Plain final : Layers {
    explicit Plain(tcp::socket socket) : stream(std::move(socket)) {}
    beast::tcp_stream& tcp() noexcept override { return stream; }
    void start(std::function<void(ErrorCode)> done) override { done({}); }
    void end(std::shared_ptr<Layers> self, std::function<void()> done) override {
        stream.expires_after(linger_timeout);
        std::make_shared<Farewell>(std::move(self), std::move(done))->begin();
    }
    void read(const List<asio::mutable_buffer>& buffers, Handler handler) override {
        stream.async_read_some(buffers, std::move(handler));
    }
    void write(const List<asio::const_buffer>& buffers, Handler handler) override {
        stream.async_write_some(buffers, std::move(handler));
    }

    beast::tcp_stream stream;
};

/// TLS over TCP.
struct Stream::Secure final : Layers {
    Secure(tcp::socket socket, ssl::context& context) : stream(std::move(socket), context) {}
    beast::tcp_stream& tcp() noexcept override { return stream.next_layer(); }
    void start(std::function<void(ErrorCode)> done) override {
        tcp().expires_after(tls_handshake_time);
        beast::async_detect_ssl(tcp(), early,
                                [this, done = std::move(done)](ErrorCode error, bool is_tls) mutable {
                                    if (error)
                                        done(error);
                                    else if (is_tls)
                                        shake_hands(std::move(done));
                                    else
                                        say_so(std::move(done));
                                });
    }
    void shake_hands(std::function<void(ErrorCode)> done) {
        stream.async_handshake(ssl::stream_base::server, early.data(),
                               [this, done = std::move(done)](ErrorCode error, std::size_t used) {
                                   early.consume(used);
                                   done(error);
                               });
    }
    void say_so(std::function<void(ErrorCode)> done) {
        asio::async_write(tcp(), asio::buffer(not_tls),
                          [this, done = std::move(done)](ErrorCode /*error*/, std::size_t) {
                              ErrorCode ignored;
                              tcp().socket().shutdown(tcp::socket::shutdown_send, ignored);
                              done(asio::error::no_protocol_option);
                          });
    }
    void end(std::shared_ptr<Layers> self, std::function<void()> done) override {
        tcp().expires_after(linger_timeout);
        const auto last = std::make_shared<Farewell>(std::move(self), std::move(done));
        // Ends with an error where the client has sent more: that is below TLS then, and read there.
        stream.async_shutdown([last](ErrorCode) { last->begin(); });
    }
    void read(const List<asio::mutable_buffer>& buffers, Handler handler) override {
        stream.async_read_some(buffers, std::move(handler));
    }
    void write(const List<asio::const_buffer>& buffers, Handler handler) override {
        stream.async_write_some(buffers, std::move(handler));
    }

    ssl::stream<beast::tcp_stream> stream;
    beast::flat_buffer early; ///< received before it was known to be TLS
};

Stream::Stream(tcp::socket socket, const Tls* tls)
    : layers_(tls == nullptr ? std::shared_ptr<Layers>(std::make_shared<Plain>(std::move(socket)))
                             : std::make_shared<Secure>(std::move(socket), tls->context().ssl)) {}

} // namespace obscura::web
