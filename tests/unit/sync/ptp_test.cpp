// SPDX-License-Identifier: Apache-2.0
#include "sync/ptp_management.hpp"
#include "sync/ptp_monitor.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstring>
#include <functional>
#include <random>
#include <thread>
#include <vector>

namespace ptp_test {

using namespace obscura;
using namespace obscura::sync;

namespace {

using Bytes = std::vector<std::uint8_t>;

/// What ptp4l makes of a question: its own header, the action turned, data behind the identifier.
Bytes answer_to(std::span<const std::uint8_t> question, const Bytes& data) {
    Bytes a(question.begin(), question.end());
    a[46] = 2;
    a[51] = static_cast<std::uint8_t>(2 + data.size());
    a.insert(a.end(), data.begin(), data.end());
    a[3] = static_cast<std::uint8_t>(a.size());
    return a;
}

Bytes data_of(PtpDataSet set, std::uint8_t port_state = 9, std::int64_t offset_ns = -1234) {
    switch (set) {
    case PtpDataSet::default_set:
        return {1, 0, 0, 1, 128, 248, 0x21, 0xFF, 0xFF, 128, 1, 2, 3, 4, 5, 6, 7, 8, 0, 0};
    case PtpDataSet::current: {
        Bytes d{0, 1};
        for (const std::int64_t ns : {offset_ns, std::int64_t{5678}})
            for (int shift = 56; shift >= 0; shift -= 8)
                d.push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(ns * 65536) >> shift));
        return d;
    }
    case PtpDataSet::parent: {
        Bytes d(32);
        d[0] = 0xAA;
        d[7] = 0xBB;
        d[24] = 0xCC;
        d[31] = 0xDD;
        return d;
    }
    case PtpDataSet::time_properties:
        return {0, 37, 0x0C, 0x20};
    case PtpDataSet::port: {
        Bytes d(26);
        d[10] = port_state;
        return d;
    }
    }
    return {};
}

/// Stands in for ptp4l: answers every question with what `reply` makes of it.
class FakePtp4l {
public:
    using Reply = std::function<std::vector<Bytes>(const Bytes&)>;
    FakePtp4l(std::string path, Reply reply) : path_(std::move(path)), reply_(std::move(reply)) {
        fd_ = socket(AF_UNIX, SOCK_DGRAM, 0);
        sockaddr_un a{};
        a.sun_family = AF_UNIX;
        std::strncpy(a.sun_path, path_.c_str(), sizeof a.sun_path - 1);
        REQUIRE(bind(fd_, reinterpret_cast<sockaddr*>(&a), sizeof a) == 0);
        const timeval timeout{0, 20'000};
        setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
        thread_ = std::thread([this] { loop(); });
    }
    ~FakePtp4l() {
        quit_ = true;
        thread_.join();
        close(fd_);
        unlink(path_.c_str());
    }

private:
    void loop() {
        while (!quit_) {
            Bytes question(1500);
            sockaddr_un from{};
            socklen_t bytes = sizeof from;
            const ssize_t n = recvfrom(fd_, question.data(), question.size(), 0,
                                       reinterpret_cast<sockaddr*>(&from), &bytes);
            if (n <= 0) continue;
            question.resize(static_cast<std::size_t>(n));
            for (const Bytes& answer : reply_(question))
                sendto(fd_, answer.data(), answer.size(), MSG_DONTWAIT, reinterpret_cast<sockaddr*>(&from),
                       bytes);
        }
    }
    std::string path_;
    Reply reply_;
    int fd_ = -1;
    std::atomic<bool> quit_{false};
    std::thread thread_;
};

PtpDataSet asked(const Bytes& question) {
    return static_cast<PtpDataSet>(question.at(52) << 8 | question.at(53));
}

/// Waits up to 10 s.
bool eventually(const std::function<bool()>& truth) {
    for (int i = 0; i < 1000; ++i) {
        if (truth()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
}

PtpMonitorSettings quick(const std::string& path) {
    PtpMonitorSettings s;
    s.socket = path;
    s.poll_ns = 5'000'000;
    return s;
}

} // namespace

TEST_CASE("answers are read field by field, and only when they answer the question") {
    PtpStatus status;
    for (const PtpDataSet set : ptp_data_sets) {
        const auto question = ptp_get(set, 24, 0x1234);
        const Bytes answer = answer_to(question, data_of(set));
        REQUIRE(ptp_take_answer(answer, set, 24, 0x1234, status));
        const PtpStatus before = status;
        CHECK_FALSE(ptp_take_answer(answer, set, 25, 0x1234, status));
        CHECK_FALSE(ptp_take_answer(answer, set, 24, 0x1235, status));
        CHECK_FALSE(ptp_take_answer(question, set, 24, 0x1234, status)); // a question is no answer
        for (const PtpDataSet other : ptp_data_sets)
            if (other != set) CHECK_FALSE(ptp_take_answer(answer, other, 24, 0x1234, status));
        for (std::size_t cut = 0; cut < answer.size(); ++cut)
            CHECK_FALSE(ptp_take_answer(std::span(answer).first(cut), set, 24, 0x1234, status));
        Bytes error = answer;
        error[49] = 2; // MANAGEMENT_ERROR_STATUS
        CHECK_FALSE(ptp_take_answer(error, set, 24, 0x1234, status));
        Bytes liar = answer;
        liar[50] = 0xFF; // a TLV longer than the message
        CHECK_FALSE(ptp_take_answer(liar, set, 24, 0x1234, status));
        liar = answer;
        liar[2] = 0xFF; // a message longer than the datagram
        CHECK_FALSE(ptp_take_answer(liar, set, 24, 0x1234, status));
        CHECK(status == before);
    }
    CHECK(status.state == PtpState::slave);
    CHECK(status.offset_ns == -1234);
    CHECK(status.path_delay_ns == 5678);
    CHECK(status.clock_id == 0x0102030405060708);
    CHECK(status.parent_id == 0xAA000000000000BB);
    CHECK(status.grandmaster_id == 0xCC000000000000DD);
    CHECK(status.clock_accuracy == 0x21);
    CHECK(status.utc_offset_s == 37);
    CHECK(status.ptp_timescale);
    // The offset from UTC is signed.
    CHECK(ptp_take_answer(answer_to(ptp_get(PtpDataSet::time_properties, 0, 1), {0xFF, 0xFB, 0x0C, 0x20}),
                          PtpDataSet::time_properties, 0, 1, status));
    CHECK(status.utc_offset_s == -5);
    // A second port that only listens does not outrank the one that follows.
    CHECK(ptp_take_answer(answer_to(ptp_get(PtpDataSet::port, 0, 1), data_of(PtpDataSet::port, 4)),
                          PtpDataSet::port, 0, 1, status));
    CHECK(status.state == PtpState::slave);
    CHECK_FALSE(ptp_take_answer(answer_to(ptp_get(PtpDataSet::port, 0, 1), data_of(PtpDataSet::port, 10)),
                                PtpDataSet::port, 0, 1, status));
}

TEST_CASE("a hundred thousand mutilated answers do no harm") {
    std::mt19937 random(1);
    int taken = 0;
    for (int i = 0; i < 100'000; ++i) {
        const PtpDataSet set = ptp_data_sets[random() % ptp_data_sets.size()];
        Bytes m = answer_to(ptp_get(set, 0, 7), data_of(set));
        for (std::uint32_t n = random() % 4; n > 0; --n)
            m[random() % m.size()] = static_cast<std::uint8_t>(random());
        m.resize(random() % 4 == 0 ? random() % (m.size() + 1) : m.size() + random() % 8);
        const Bytes exact(m.begin(), m.end()); // its own heap block: a sanitizer sees reads beyond
        PtpStatus status;
        taken += ptp_take_answer(exact, set, 0, 7, status);
        REQUIRE(status.state <= PtpState::slave);
    }
    CHECK(taken > 10'000);
    CHECK(taken < 90'000);
}

TEST_CASE("what TAI lacks is added once the clock is locked, and while the kernel does not know it") {
    PtpStatus status;
    status.utc_offset_s = 37;
    status.ptp_timescale = true;
    CHECK(tai_correction_from(status, 0, 0) == 0);
    status.locked = true;
    CHECK(tai_correction_from(status, 0, 0) == 37'000'000'000);
    CHECK(tai_correction_from(status, 37, 37'000'000'000) == 0);
    status.locked = false; // holds on
    CHECK(tai_correction_from(status, 0, 37'000'000'000) == 37'000'000'000);
    status.locked = true;
    status.ptp_timescale = false; // an arbitrary time is no TAI
    CHECK(tai_correction_from(status, 0, 0) == 0);
}

TEST_CASE("the monitor follows ptp4l as it comes, locks, drifts, talks nonsense and goes") {
    const test::TempFolder folder;
    const std::string path = (folder.path() / "ptp4l").string();
    PtpMonitor monitor(quick(path));
    CHECK(monitor.status().state == PtpState::unknown);
    {
        std::atomic<std::int64_t> offset{50'000};
        std::atomic<bool> nonsense{false};
        FakePtp4l ptp4l(path, [&](const Bytes& q) -> std::vector<Bytes> {
            const Bytes good = answer_to(q, data_of(asked(q), 9, offset));
            if (nonsense) return {Bytes(1400, 0xFF), Bytes{0xD}, Bytes(q)};
            // Something foreign first: it is passed over.
            return {Bytes(3, 0), q, good};
        });
        REQUIRE(eventually([&] { return monitor.status().state == PtpState::slave; }));
        CHECK_FALSE(monitor.status().locked);
        CHECK(monitor.status().offset_ns == 50'000);
        offset = 300;
        REQUIRE(eventually([&] { return monitor.status().locked; }));
        CHECK(monitor.status().grandmaster_id == 0xCC000000000000DD);
        nonsense = true;
        REQUIRE(eventually([&] { return monitor.status().state == PtpState::unknown; }));
        nonsense = false;
        REQUIRE(eventually([&] { return monitor.status().locked; }));
    }
    REQUIRE(eventually([&] { return monitor.status().state == PtpState::unknown; }));
    CHECK_FALSE(monitor.status().locked);
    FakePtp4l again(path,
                    [](const Bytes& q) { return std::vector<Bytes>{answer_to(q, data_of(asked(q), 6))}; });
    REQUIRE(eventually([&] { return monitor.status().state == PtpState::master; }));
    CHECK(monitor.status().locked); // the clock of the network
}

TEST_CASE(
    "the monitor gives signs of life whether ptp4l answers, is silent or is away, and between its rounds") {
    const test::TempFolder folder;
    const std::string path = (folder.path() / "ptp4l").string();
    PtpMonitorSettings settings = quick(path);
    const auto beats = [](const PtpMonitor& monitor) {
        const std::uint64_t before = monitor.heartbeat().beats();
        return eventually([&] { return monitor.heartbeat().beats() > before + 1; }) &&
               !monitor.heartbeat().may_be_silent(Time{});
    };
    {
        const PtpMonitor away(settings);
        CHECK(beats(away));
    }
    settings.poll_ns = 3'600'000'000'000;
    {
        const PtpMonitor waiting(settings);
        CHECK(beats(waiting));
    }
    settings.poll_ns = 5'000'000;
    const FakePtp4l silent(path, [](const Bytes&) { return std::vector<Bytes>{}; });
    const PtpMonitor asking(settings);
    CHECK(beats(asking));
}

TEST_CASE("what counts as locked") {
    PtpStatus s;
    const auto locked = [&](PtpState state, std::int64_t offset_ns, std::int64_t path_ns) {
        s.state = state;
        s.offset_ns = offset_ns;
        s.path_delay_ns = path_ns;
        return ptp_locked(s, 1000);
    };
    CHECK(locked(PtpState::master, 0, 0));
    CHECK(locked(PtpState::slave, -1000, 0));
    CHECK_FALSE(locked(PtpState::slave, 1001, 500));
    CHECK_FALSE(locked(PtpState::slave, INT64_MIN, 500));
    CHECK(locked(PtpState::uncalibrated, 10, 500));
    CHECK_FALSE(locked(PtpState::uncalibrated, 0, 0)); // nothing measured yet
    CHECK_FALSE(locked(PtpState::listening, 0, 500));
    CHECK_FALSE(locked(PtpState::unknown, 0, 500));
}

} // namespace ptp_test
