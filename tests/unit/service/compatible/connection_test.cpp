// SPDX-License-Identifier: Apache-2.0
// The compatible protocol from the client's side of the socket: unread answers, errors, and clients that do
// as they please.
#include "service/compatible/codec.hpp"
#include "service/compatible/connection.hpp"
#include "service/server.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/service_bench.hpp"

#include <sys/socket.h>

#include <atomic>
#include <memory>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

using namespace obscura;
using Catch::Matchers::ContainsSubstring;
using namespace std::chrono_literals;
namespace compatible = service::compatible;
using compatible::Bytes;
using compatible::Fields;
using compatible::List;
using compatible::Value;
using service::Limits;
using service::Listener;
using service::Server;
using service::Work;

namespace {

/// Counts positions, and refuses those of "nothing"; getImage gives as many bytes as positions; render waits
/// until it is cancelled.
class TestHost final : public compatible::Host {
public:
    std::atomic<int> calls{0}, rendering{0}, cancelled{0}, sessions{0};
    std::size_t picture_bytes = 100;

    [[nodiscard]] std::unique_ptr<compatible::Session> open(service::MemoryAccount& /*memory*/) override {
        return std::make_unique<TestSession>(*this);
    }

private:
    class TestSession final : public compatible::Session {
    public:
        explicit TestSession(TestHost& host) : host_(host) { ++host_.sessions; }
        ~TestSession() override { --host_.sessions; }
        void run(const compatible::Command& command, const compatible::Arguments& arguments, Work& work,
                 compatible::Reply& reply) override {
            ++host_.calls;
            if (command.name == "setObjectPosition" && arguments.text("object_name") == "nothing")
                throw service::bad_argument("object_name", "setObjectPosition: no such object");
            if (command.name == "version") reply.set("version", "test");
            if (command.name == "getSunPower") throw std::logic_error("a fault");
            if (command.name == "enableRaytracing") reply.warn("slow");
            if (command.name == "getImage") {
                reply.set("call", host_.calls.load());
                reply.set_bytes("image_data", std::string(host_.picture_bytes, 'p'));
            }
            if (command.name != "render") return;
            ++host_.rendering;
            while (!work.cancelled())
                std::this_thread::sleep_for(1ms);
            ++host_.cancelled;
        }

    private:
        TestHost& host_;
    };
};

struct Bench {
    explicit Bench(const compatible::CompatibleLimits& door = {}, std::size_t clients = 16) {
        Limits limits;
        limits.clients = clients;
        limits.local_clients = 0;
        auto server = std::make_unique<Server>(limits, native_, std::vector<Listener>());
        server->add({Listener::unix_socket(path()),
                     [this, door](FileDescriptor socket, std::function<void()> wake) {
                         return std::make_unique<compatible::Connection>(std::move(socket), door, host,
                                                                         memory, std::move(wake));
                     },
                     {.refusal = compatible::line_packet("[error] full").start}});
        server_.start(std::move(server));
    }
    [[nodiscard]] std::string path() const { return server_.path(); }

    TestHost host;
    service::MemoryAccount memory{std::uint64_t{64} << 20};

private:
    class NoHost final : public service::Host {
    public:
        [[nodiscard]] std::string version() const override { return ""; }
        [[nodiscard]] std::unique_ptr<service::Session> open() override { return nullptr; }
    };
    NoHost native_;
    test::ServerThread server_;
};

class Client {
public:
    explicit Client(const Bench& bench) : socket_(test::connect_to(bench.path())) {}
    void write(std::string_view text) { test::send_all(socket_, text); }
    /// Whether the server still takes bytes.
    bool sends(std::string_view text) {
        return ::send(socket_.get(), text.data(), text.size(), MSG_NOSIGNAL) ==
               static_cast<ssize_t>(text.size());
    }
    void call(const char* name, Fields arguments = {}) {
        arguments.insert(arguments.begin(), {"", name});
        write(compatible::encode(arguments));
    }
    void move(const char* object = "ball") {
        call("setObjectPosition", {{"object_name", object}, {"pos", List{1.0, 2.0, 3.0}}});
    }
    /// The next message; none: the connection has ended.
    std::optional<Fields> next() {
        while (true) {
            input_.erase(0, decoder_.read(input_));
            if (decoder_.complete()) return decoder_.take();
            char bytes[65536];
            const ssize_t got = ::recv(socket_.get(), bytes, sizeof bytes, 0);
            if (got <= 0) return std::nullopt;
            input_.append(bytes, static_cast<std::size_t>(got));
        }
    }
    /// As the published client waits: skips messages until one bears the name; throws at a line `[error]`.
    Fields wait_for(const char* name) {
        while (true) {
            const std::optional<Fields> message = next();
            if (!message) throw std::runtime_error("the connection has ended");
            const Value* const named = find(*message, "");
            if (named != nullptr && *named == Value(name)) return *message;
            const Value* const data = find(*message, "data");
            if (named == nullptr && data != nullptr && data->as<Bytes>()->data.starts_with("[error]"))
                throw std::runtime_error(data->as<Bytes>()->data);
        }
    }
    Fields ask(const char* name) {
        call(name);
        return wait_for(name);
    }
    void end() { socket_ = FileDescriptor(); }

private:
    FileDescriptor socket_;
    std::string input_;
    compatible::Decoder decoder_{compatible::CompatibleLimits{}};
};

} // namespace

TEST_CASE("calls are answered under their names", "[service]") {
    Bench bench;
    Client client(bench);
    CHECK(*find(client.ask("version"), "version") == Value("test"));
    CHECK(find(client.ask("getImage"), "image_data")->as<Bytes>()->data == std::string(100, 'p'));
}

TEST_CASE("300,000 unread answers neither hang client nor server", "[service]") {
    Bench bench;
    Client client(bench);
    for (int i = 0; i < 300'000; ++i)
        client.move();
    CHECK(*find(client.ask("version"), "version") == Value("test"));
    CHECK(bench.host.calls == 300'001);
}

TEST_CASE("pictures that are asked for and not read do not gather", "[service]") {
    Bench bench;
    bench.host.picture_bytes = 4 << 20;
    Client client(bench);
    for (int i = 0; i < 2000; ++i)
        client.call("getImage");
    // At most one of them is begun, the last is this one.
    int seen = 0;
    client.call("version");
    while (*find(*client.next(), "") != Value("version"))
        ++seen;
    CHECK(seen <= 2);
}

TEST_CASE("after an error the next picture is never the one before", "[service]") {
    compatible::CompatibleLimits limits;
    limits.hold_ms = 1h;
    Bench bench(limits);
    Client client(bench);
    // The unread error of a setter, then a getter, then its retry.
    client.move("nothing");
    client.call("getImage");
    CHECK_THROWS_WITH(client.wait_for("getImage"), ContainsSubstring("no such object"));
    CHECK(*find(client.ask("getImage"), "call") == Value(3));
    // A getter that fails by itself: the next one, of any name, is answered at once.
    CHECK_THROWS_WITH(client.ask("getSunPower"), ContainsSubstring("a fault"));
    CHECK(*find(client.ask("getImage"), "call") == Value(5));
    CHECK_THROWS_WITH(client.ask("getSunPower"), ContainsSubstring("a fault"));
    CHECK_THROWS_WITH(client.ask("getSunPower"), ContainsSubstring("a fault"));
    CHECK(*find(client.ask("version"), "version") == Value("test"));
}

TEST_CASE("a client that ignores errors is answered in the end", "[service]") {
    compatible::CompatibleLimits limits;
    limits.hold_ms = 50ms;
    Bench bench(limits);
    Client client(bench);
    client.move("nothing");
    client.call("getImage");
    std::optional<Fields> message = client.next();
    while (message && (find(*message, "") == nullptr || *find(*message, "") != Value("getImage")))
        message = client.next();
    CHECK(message);
}

TEST_CASE("an unknown command and wrong arguments are lines, and the connection lives", "[service]") {
    Bench bench;
    Client client(bench);
    client.call("makeCoffee");
    client.call("version");
    CHECK_THROWS_WITH(client.wait_for("version"), "[error] no call 'makeCoffee'");
    client.call("verison");
    client.call("version");
    CHECK_THROWS_WITH(client.wait_for("version"), "[error] no call 'verison'; did you mean \"version\"?");
    client.write(compatible::encode({}));
    client.call("version");
    CHECK_THROWS_WITH(client.wait_for("version"), "[error] no call ''");
    client.call("exists", {{"object_name", 1}});
    CHECK_THROWS_WITH(client.wait_for("exists"),
                      ContainsSubstring("exists: object_name: is of another type"));
    CHECK(*find(client.ask("version"), "version") == Value("test"));
}

TEST_CASE("warnings are printed, not raised", "[service]") {
    Bench bench;
    Client client(bench);
    client.call("enableRaytracing", {{"enable", true}});
    const std::optional<Fields> line = client.next();
    REQUIRE(line);
    CHECK(find(*line, "data")->as<Bytes>()->data == "[warning] slow");
    CHECK(*find(client.ask("version"), "version") == Value("test"));
}

TEST_CASE("a fault of the encoding is told, and ends the connection", "[service]") {
    Bench bench;
    Client client(bench);
    client.write(std::string_view("\0\0\0\1\0\0\0\3abc", 11));
    const std::optional<Fields> line = client.next();
    REQUIRE(line);
    CHECK_THAT(find(*line, "data")->as<Bytes>()->data,
               ContainsSubstring("[error] a string of an odd number"));
    CHECK_FALSE(client.next());
    Client other(bench);
    CHECK(*find(other.ask("version"), "version") == Value("test"));
}

TEST_CASE("what comes after a fault of the encoding is thrown away until the client has read its line",
          "[service]") {
    compatible::CompatibleLimits limits;
    limits.linger_timeout_ms = 60s;
    Bench bench(limits);
    Client client(bench);
    client.write(std::string_view("\0\0\0\1\0\0\0\3abc", 11));
    // Much more than sockets hold: it is taken, or this would not return.
    client.write(std::string(std::size_t{16} << 20, 'x'));
    REQUIRE(client.next());
    CHECK_FALSE(client.next());
    CHECK(client.sends("x"));
}

TEST_CASE("what was sent before close is done, though nothing was read", "[service]") {
    Bench bench;
    {
        Client client(bench);
        for (int i = 0; i < 100'000; ++i)
            client.move();
        client.call("close");
    }
    test::until([&] { return bench.host.sessions == 0; });
    CHECK(bench.host.calls == 100'000);
}

TEST_CASE("a client that is gone without close cancels its rendering", "[service]") {
    Bench bench;
    Client client(bench);
    client.call("render");
    test::until([&] { return bench.host.rendering == 1; });
    client.end();
    test::until([&] { return bench.host.cancelled == 1 && bench.host.sessions == 0; });
}

TEST_CASE("requests wait outside while too many are to be done", "[service]") {
    compatible::CompatibleLimits limits;
    limits.requests = 8;
    Bench bench(limits);
    Client client(bench);
    for (int i = 0; i < 50'000; ++i)
        client.move();
    CHECK(*find(client.ask("version"), "version") == Value("test"));
    CHECK(bench.host.calls == 50'001);
}

TEST_CASE("a client beyond the limit gets a line, and its connection is closed", "[service]") {
    Bench bench({}, 1);
    Client first(bench);
    (void)first.ask("version");
    Client second(bench);
    const std::optional<Fields> line = second.next();
    REQUIRE(line);
    CHECK(find(*line, "data")->as<Bytes>()->data == "[error] full");
    CHECK_FALSE(second.next());
    CHECK(*find(first.ask("version"), "version") == Value("test"));
}

TEST_CASE("a message that does not end is given up", "[service]") {
    compatible::CompatibleLimits limits;
    limits.message_ms = 100ms;
    Bench bench(limits);
    Client client(bench);
    client.write(std::string_view("\0\0\0\1\0\0", 6));
    const std::optional<Fields> line = client.next();
    REQUIRE(line);
    CHECK_THAT(find(*line, "data")->as<Bytes>()->data, ContainsSubstring("takes longer than 100 ms"));
    CHECK_FALSE(client.next());
}

TEST_CASE("a message for which there is no memory is one line, and others go on", "[service]") {
    Bench bench;
    Client other(bench);
    (void)other.ask("version");
    {
        Client client(bench);
        // 13 bytes each, and 80 once they are read.
        client.call("setMetadata", {{"name", "n"}, {"value", List(2'000'000, Value(0.5))}});
        const std::optional<Fields> line = client.next();
        REQUIRE(line);
        CHECK_THAT(find(*line, "data")->as<Bytes>()->data,
                   ContainsSubstring("[error] ") && ContainsSubstring("that clients hold, allowed 67108864"));
        CHECK_FALSE(client.next());
        CHECK(*find(other.ask("version"), "version") == Value("test"));
    }
    test::until([&] { return bench.memory.used() == 0; });
    // What fits is read, and given back once it has been done.
    other.call("setMetadata", {{"name", "n"}, {"value", List(200'000, Value(0.5))}});
    CHECK(*find(other.ask("version"), "version") == Value("test"));
    CHECK(bench.memory.used() == 0);
}

TEST_CASE("noise of many clients leaves another's calls alone", "[service]") {
    Bench bench;
    std::atomic<bool> stop{false};
    std::thread noise([&] {
        std::mt19937 random(7);
        while (!stop) {
            try {
                Client client(bench);
                std::string text(random() % 200, '\0');
                for (char& c : text)
                    c = static_cast<char>(random() % 8 != 0 ? 0 : random());
                client.write(text);
            } catch (const std::runtime_error&) {
                std::this_thread::sleep_for(1ms);
            }
        }
    });
    Client client(bench);
    for (int i = 0; i < 300; ++i)
        CHECK(*find(client.ask("version"), "version") == Value("test"));
    stop = true;
    noise.join();
}
