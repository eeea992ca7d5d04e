// SPDX-License-Identifier: Apache-2.0
#include "web/http_server.hpp"

#include "core/error.hpp"
#include "web/connection_counts.hpp"
#include "web/http_request.hpp"
#include "web/http_response.hpp"
#include "web/live/live_session.hpp"
#include "web/live/mjpeg_session.hpp"
#include "web/server/answer_writer.hpp"
#include "web/server/endpoint.hpp"
#include "web/server/problem.hpp"
#include "web/server/stream.hpp"
#include "web/server/worker.hpp"

// Asio of Boost 1.74 needs it included before.
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <fmt/format.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <list>
#include <map>
#include <optional>
#include <utility>

namespace obscura::web {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using ErrorCode = beast::error_code;

constexpr std::chrono::milliseconds stream_period{200};
constexpr std::chrono::seconds stream_silence{15}; ///< after which a comment shows that the server lives
constexpr std::size_t max_event_batch = 64;

/// Has a client's bytes wait here rather than in the system, where they would be old before they leave, and
/// behind those of cameras on the same interface. Without effect on sockets that are not of TCP.
void set_bulk_transfer(int socket) {
    constexpr int unsent_bytes = 16 << 10, bulk = 2; // TC_PRIO_BULK
    ::setsockopt(socket, IPPROTO_TCP, TCP_NOTSENT_LOWAT, &unsent_bytes, sizeof unsent_bytes);
    ::setsockopt(socket, SOL_SOCKET, SO_PRIORITY, &bulk, sizeof bulk);
}

/// What the connections share; all of it on the server's thread.
struct Shared {
    const HttpLimits& limits;
    Routes& routes;
    const DaemonWatch& watch;
    Worker& worker;
    WebFigures& figures;
    LiveServices live{};
    std::size_t streams = 0;
    std::size_t answer_bytes = 0; ///< of answers that are being sent
    ConnectionCounts connected{};
};

/// One connection, kept alive by its pending operation.
class Connection : public std::enable_shared_from_this<Connection> {
public:
    Connection(Stream stream, Shared& shared, std::string address, bool only_health)
        : stream_(std::move(stream)),
          timer_(stream_.get_executor()),
          shared_(shared),
          counted_(shared.connected, std::move(address)),
          only_health_(only_health) {}
    ~Connection() {
        if (streaming_) --shared_.streams;
    }
    Connection(const Connection&) = delete;
    Connection& operator=(const Connection&) = delete;

    void start() {
        stream_.start([self = shared_from_this()](ErrorCode error) {
            if (!error) self->begin();
        });
    }

    /// Waits for the first bytes of a request.
    void begin() {
        parser_.emplace();
        set_limits(*parser_, shared_.limits);
        if (buffer_.size() > 0) {
            read_header();
            return;
        }
        stream_.next_layer().expires_after(shared_.limits.idle_ms);
        stream_.async_read_some(buffer_.prepare(2048),
                                [self = shared_from_this()](ErrorCode error, std::size_t bytes) {
                                    if (error) return;
                                    self->buffer_.commit(bytes);
                                    self->read_header();
                                });
    }

private:
    void read_header() {
        stream_.next_layer().expires_after(shared_.limits.header_ms);
        http::async_read_header(stream_, buffer_, *parser_,
                                [self = shared_from_this()](ErrorCode error, std::size_t) {
                                    if (error)
                                        self->refuse(error);
                                    else if (auto refused = refusal_of_header(*self->parser_))
                                        self->refuse(*std::move(refused));
                                    else if (waits_for_continue(*self->parser_))
                                        self->send_continue();
                                    else
                                        self->read_body();
                                });
    }

    void send_continue() {
        static constexpr std::string_view line = "HTTP/1.1 100 Continue\r\n\r\n";
        asio::async_write(stream_, asio::buffer(line.data(), line.size()),
                          [self = shared_from_this()](ErrorCode error, std::size_t) {
                              if (!error) self->read_body();
                          });
    }

    void read_body() {
        stream_.next_layer().expires_after(shared_.limits.body_ms);
        http::async_read(stream_, buffer_, *parser_,
                         [self = shared_from_this()](ErrorCode error, std::size_t) {
                             if (error)
                                 self->refuse(error);
                             else
                                 self->answer();
                         });
    }

    /// A request that cannot be read: what follows it is not where the next one begins.
    void refuse(ErrorCode error) {
        if (error.category() != http::make_error_code(http::error::bad_field).category() ||
            error == http::error::end_of_stream || error == http::error::partial_message)
            return;
        refuse(refusal_of(error));
    }

    void refuse(Response response) {
        route_ = "unreadable";
        send(std::move(response), 11, false, false);
    }

    void answer() {
        const auto& message = parser_->get();
        Request request = request_of(message);
        request.address = counted_.address();
        Response response;
        if (only_health_ && request.target != "/livez") {
            response.status = 503;
            response.type = "text/plain; charset=utf-8";
            response.body = "too many connections\n";
        } else {
            response = shared_.routes.answer(request);
        }
        if (!response.session.empty() && !counted_.join(response.session, shared_.limits.of_one_session)) {
            Response busy = problem(503, "too-many-connections", "too many connections of this session");
            busy.route = response.route;
            response = std::move(busy);
        }
        route_ = response.route.empty() ? "other" : response.route;
        // Nothing else is wrong with a request that only lacks its upgrade.
        if (response.status == 426 && is_live_upgrade(message) && buffer_.size() == 0 &&
            shared_.live.pictures) {
            if (shared_.live.viewers < LiveServices::max_viewers) {
                shared_.figures.answered(route_, 101);
                (void)counted_.join("live ", shared_.limits.connections); // they have a limit of their own
                begin_live_session(std::move(stream_), message, counted_.address(), shared_.live,
                                   shared_from_this());
                return;
            }
            response = problem(503, "too-many-viewers", "too many viewers");
        }
        if (response.job) {
            take_job(*std::move(response.job));
            return;
        }
        give(std::move(response));
    }

    /// Hands a job to the worker; what it answers comes back to this thread.
    void take_job(Job job) {
        stream_.next_layer().expires_never();
        // The last reference to this connection may end on the server's thread only.
        const bool taken =
            shared_.worker.take(std::move(job), [self = shared_from_this()](Response response) mutable {
                const auto executor = self->stream_.get_executor();
                asio::post(executor, [self = std::move(self), response = std::move(response)]() mutable {
                    self->give(std::move(response));
                });
            });
        if (taken) return;
        Response response = problem(503, "busy", "too many requests wait for a daemon");
        response.headers.emplace_back("Retry-After", "1");
        give(std::move(response));
    }

    /// Sends the answer to the request that was read.
    void give(Response response) {
        const auto& message = parser_->get();
        const bool head = message.method() == http::verb::head;
        const unsigned version = message.version();
        const bool keep_alive = message.keep_alive() && !only_health_;
        const bool pictures = !response.pictures_of.empty();
        // Clients that read slowly must not fill the memory with frames.
        if (response.body.size() > part_bytes && shared_.answer_bytes > 0 &&
            shared_.answer_bytes + response.body.size() > shared_.limits.answer_bytes) {
            response = problem(503, "busy", "too many clients are still reading their answers");
            response.headers.emplace_back("Retry-After", "1");
        }
        if ((response.stream_after || pictures) && !head) {
            if (shared_.streams >= shared_.limits.streams ||
                (pictures && (!shared_.live.pictures || shared_.live.viewers >= LiveServices::max_viewers))) {
                response = problem(503, "too-many-streams", "too many streams");
            } else {
                begin_stream(response, version);
                return;
            }
        }
        send(std::move(response), version, keep_alive, head);
    }

    void send(Response response, unsigned version, bool keep_alive, bool head) {
        shared_.figures.answered(route_, response.status);
        const auto out = std::make_shared<Answer>(static_cast<http::status>(response.status), version);
        set_headers(*out, response);
        out->keep_alive(keep_alive);
        out->body() = std::move(response.body);
        out->prepare_payload();
        if (head) out->body().clear();
        const std::size_t bytes = out->body().size();
        shared_.answer_bytes += bytes;
        write_answer(stream_, out, head, shared_.limits.write_ms,
                     [self = shared_from_this(), keep_alive, bytes](ErrorCode error, std::size_t sent) {
                         self->shared_.answer_bytes -= bytes;
                         self->shared_.figures.sent(sent);
                         if (error) return;
                         if (keep_alive)
                             self->begin();
                         else
                             self->close();
                     });
    }

    void begin_stream(const Response& response, unsigned version) {
        shared_.figures.answered(route_, response.status);
        streaming_ = true;
        ++shared_.streams;
        after_ = response.stream_after.value_or(0);
        text_ = response.body;
        const std::optional<CameraId> camera = camera_id_of(response.pictures_of);
        const auto out = std::make_shared<http::response<http::empty_body>>(http::status::ok, version);
        set_headers(*out, response);
        out->chunked(version >= 11 && !camera);
        out->keep_alive(false);
        chunked_ = out->chunked();
        const auto serializer = std::make_shared<http::response_serializer<http::empty_body>>(*out);
        stream_.next_layer().expires_after(shared_.limits.write_ms);
        http::async_write_header(
            stream_, *serializer,
            [self = shared_from_this(), out, serializer, camera](ErrorCode error, std::size_t) {
                if (error) return;
                if (camera)
                    begin_mjpeg_session(std::move(self->stream_), *camera, self->shared_.live, self);
                else
                    self->go_on();
            });
    }

    /// Sends the events that have come, or looks again in a while.
    void go_on() {
        for (const WatchedEvent& event : shared_.watch.events(after_, max_event_batch)) {
            if (after_ > 0 && event.id != after_ + 1) text_ += Routes::lost_text(after_, event.id);
            text_ += Routes::event_text(event, shared_.watch.run());
            after_ = event.id;
        }
        const auto now = std::chrono::steady_clock::now();
        if (text_.empty() && now - sent_ < stream_silence) {
            timer_.expires_after(stream_period);
            timer_.async_wait([self = shared_from_this()](ErrorCode error) {
                if (!error) self->go_on();
            });
            return;
        }
        if (text_.empty()) text_ = ": \n\n";
        sent_ = now;
        stream_.next_layer().expires_after(shared_.limits.write_ms);
        const auto done = [self = shared_from_this()](ErrorCode error, std::size_t bytes) {
            self->shared_.figures.sent(bytes);
            if (error) return;
            self->stream_.next_layer().expires_never();
            self->text_.clear();
            self->go_on();
        };
        if (chunked_)
            asio::async_write(stream_, http::make_chunk(asio::buffer(text_)), done);
        else
            asio::async_write(stream_, asio::buffer(text_), done);
    }

    void close() {
        ErrorCode ignored;
        const bool has_more =
            buffer_.size() > 0 || stream_.next_layer().socket().available(ignored) > 0 || !parser_->is_done();
        // Counts among the connections until the client has ended, too.
        stream_.end(has_more ? [self = shared_from_this()] {} : std::function<void()>());
    }

    Stream stream_;
    asio::steady_timer timer_;
    Shared& shared_;
    CountedConnection counted_;
    const bool only_health_;
    beast::flat_static_buffer<16384> buffer_;
    std::optional<Parser> parser_;
    bool streaming_ = false, chunked_ = true;
    std::uint64_t after_ = 0;
    std::string text_;
    std::string_view route_ = "other"; ///< of the request that is answered
    std::chrono::steady_clock::time_point sent_ = std::chrono::steady_clock::now();
};

} // namespace

bool is_loopback(const std::string& address) {
    return endpoint_of(address).address().is_loopback();
}

bool is_wildcard(const std::string& address) {
    return endpoint_of(address).address().is_unspecified();
}

bool is_here(const std::string& address) {
    const asio::ip::address ip = endpoint_of(address).address();
    asio::io_context io;
    tcp::acceptor trial(io);
    ErrorCode error;
    trial.open(ip.is_v6() ? tcp::v6() : tcp::v4(), error);
    if (!error) trial.bind({ip, 0}, error);
    return !error;
}

std::string host_of(const std::string& address) {
    const asio::ip::address ip = endpoint_of(address).address();
    return ip.is_v6() ? fmt::format("[{}]", ip.to_string()) : ip.to_string();
}

class HttpServer::Impl {
public:
    Impl(const HttpLimits& limits, const std::vector<std::string>& addresses, const Tls* tls)
        : limits_(limits), tls_(tls), timer_(io_) {
        for (const std::string& address : addresses)
            listen(address);
    }

    ~Impl() {
        if (live_) live_->stop(); // it delivers to the connections
    }
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;

    [[nodiscard]] std::vector<std::uint16_t> ports() const {
        std::vector<std::uint16_t> all;
        for (const PausableAcceptor& listening : acceptors_)
            all.push_back(listening.acceptor.local_endpoint().port());
        return all;
    }

    void run(Routes& routes, const DaemonWatch& watch, const std::function<bool()>& stopped) {
        Worker worker;
        shared_.emplace(Shared{limits_, routes, watch, worker, routes.figures()});
        shared_->live.pictures = live_;
        shared_->live.figures = &routes.figures();
        shared_->live.refusal = [&routes](std::string_view token, const std::string& address) {
            return routes.token_refusal(token, address);
        };
        for (PausableAcceptor& listening : acceptors_)
            accept(listening);
        look(stopped);
        io_.run();
    }

    void serve_live(std::shared_ptr<LivePictures> pictures) { live_ = std::move(pictures); }

private:
    /// An address where it listens.
    struct PausableAcceptor {
        explicit PausableAcceptor(asio::io_context& io) : acceptor(io), pause(io) {}
        tcp::acceptor acceptor;
        asio::steady_timer pause;
    };

    void listen(const std::string& address) {
        const tcp::endpoint endpoint = endpoint_of(address);
        tcp::acceptor& acceptor = acceptors_.emplace_back(io_).acceptor;
        ErrorCode error;
        const auto refuse = [&] {
            if (error) throw HardwareError(fmt::format("{}: {}", address, error.message()));
        };
        acceptor.open(endpoint.protocol(), error);
        refuse();
        acceptor.set_option(asio::socket_base::reuse_address(true), error);
        refuse();
        acceptor.bind(endpoint, error);
        refuse();
        acceptor.listen(asio::socket_base::max_listen_connections, error);
        refuse();
    }

    void accept(PausableAcceptor& listening) {
        listening.acceptor.async_accept([this, &listening](ErrorCode error, tcp::socket socket) {
            if (error == asio::error::operation_aborted) return;
            if (error) {
                accept_later(listening);
                return;
            }
            take(std::move(socket));
            accept(listening);
        });
    }

    /// The client that could not be accepted still waits: without a pause the next try would fail as well,
    /// and so on, as long as there is no descriptor for it.
    void accept_later(PausableAcceptor& listening) {
        listening.pause.expires_after(std::chrono::milliseconds(100));
        listening.pause.async_wait([this, &listening](ErrorCode error) {
            if (!error) accept(listening);
        });
    }

    void take(tcp::socket socket) {
        ErrorCode error;
        const tcp::endpoint peer = socket.remote_endpoint(error);
        if (error) return;
        socket.set_option(tcp::no_delay(true), error);
        set_bulk_transfer(socket.native_handle());
        std::string address = peer.address().to_string();
        const ConnectionCounts& connected = shared_->connected;
        const std::size_t strangers = connected.strangers.of(address);
        const bool full =
            connected.all >= limits_.connections || strangers >= limits_.strangers_of_one_address;
        if (connected.all >= limits_.connections + limits_.for_health ||
            strangers >= limits_.strangers_of_one_address + limits_.for_health)
            return; // closes it
        std::make_shared<Connection>(Stream(std::move(socket), tls_), *shared_, std::move(address), full)
            ->start();
    }

    void look(const std::function<bool()>& stopped) {
        timer_.expires_after(std::chrono::milliseconds(200));
        timer_.async_wait([this, &stopped](ErrorCode) {
            if (stopped())
                io_.stop();
            else
                look(stopped);
        });
    }

    const HttpLimits limits_;
    const Tls* const tls_;
    std::shared_ptr<LivePictures> live_;
    std::optional<Shared> shared_; ///< outlives the connections, which operations of io_ keep alive
    asio::io_context io_{1};
    std::list<PausableAcceptor> acceptors_;
    asio::steady_timer timer_;
};

HttpServer::HttpServer(const HttpLimits& limits, const std::vector<std::string>& addresses, const Tls* tls)
    : impl_(std::make_unique<Impl>(limits, addresses, tls)) {}
HttpServer::~HttpServer() = default;

std::vector<std::uint16_t> HttpServer::ports() const {
    return impl_->ports();
}

void HttpServer::serve_live(std::shared_ptr<LivePictures> pictures) {
    impl_->serve_live(std::move(pictures));
}

void HttpServer::run(Routes& routes, const DaemonWatch& watch, const std::function<bool()>& stopped) {
    impl_->run(routes, watch, stopped);
}

} // namespace obscura::web
