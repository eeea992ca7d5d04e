// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: what a client sends behind the handshake of /api/v1/live: frames of WebSocket, whole and
// broken, and the messages in them. Whatever comes, the session ends with its connection and leaves no viewer
// behind.
#include "core/io/file_descriptor.hpp"
#include "tests/fuzz/scratch_folder.hpp"
#include "web/live/live_session.hpp"
#include "web/live/web_figures.hpp"

#include <boost/asio/io_context.hpp>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

using namespace obscura;
using namespace obscura::web;
using test::require;
namespace asio = boost::asio;
namespace http = boost::beast::http;

namespace {

/// What the sessions of a server share. No daemon is there.
struct Server {
    asio::io_context context{1};
    WebFigures figures;
    std::shared_ptr<LivePictures> pictures = std::make_shared<LivePictures>();
    LiveServices services{pictures,
                          [](std::string_view token, const std::string& /*address*/) {
                              return token == "t" ? std::nullopt : std::optional<std::string>("unknown");
                          },
                          0, &figures};
};

LiveRequest upgrade() {
    LiveRequest request{http::verb::get, std::string(live_path), 11};
    request.set(http::field::host, "localhost");
    request.set(http::field::upgrade, "websocket");
    request.set(http::field::connection, "Upgrade");
    request.set(http::field::sec_websocket_key, "dGhlIHNhbXBsZSBub25jZQ==");
    request.set(http::field::sec_websocket_version, "13");
    request.set(http::field::sec_websocket_protocol, std::string(live_protocol));
    return request;
}

/// Throws away what the server has sent.
void drain(int client) {
    std::array<char, 65536> bytes;
    while (::recv(client, bytes.data(), bytes.size(), MSG_DONTWAIT) > 0)
        continue;
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static Server server;
    static const LiveRequest request = upgrade();
    std::array<int, 2> ends{};
    require(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) == 0);
    const FileDescriptor client(ends[1]);
    asio::ip::tcp::socket socket(server.context);
    socket.assign(asio::ip::tcp::v4(), ends[0]); // read and written alike
    server.context.restart();
    begin_live_session(Stream(std::move(socket), nullptr), request, "127.0.0.1", server.services, nullptr);
    require(::send(client.get(), data, size, MSG_NOSIGNAL) == static_cast<ssize_t>(size));
    ::shutdown(client.get(), SHUT_WR);
    while (!server.context.stopped()) {
        server.context.run_one_for(std::chrono::milliseconds(1));
        drain(client.get());
    }
    require(server.services.viewers == 0);
    server.pictures->visited({}); // forgets cameras without viewers
    return 0;
}
