// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: a message of the native protocol from anywhere, frame and head. Whatever it holds, it is
// read or refused in one line; a head that was read is written and read back as the same, and its fields make
// a call or a refusal.
#include "core/error.hpp"
#include "service/call.hpp"
#include "service/failure.hpp"
#include "service/message.hpp"
#include "tests/fuzz/scratch_folder.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

using namespace obscura;
using namespace obscura::service;
using test::require;

namespace {

struct Arguments {
    double number = 0;
    std::uint32_t count = 0;
    std::array<double, 3> numbers{};
    std::string text;
    bool flag = false;
    nlohmann::json value;

    Fields fields() {
        return {{config::key("number", &number).range(0, 10), config::key("count", &count).range(1, 100),
                 config::key("numbers", config::Numbers{numbers.data(), numbers.size()}),
                 config::key("text", &text), config::key("flag", &flag)},
                {{"value", "any", "", &value}}};
    }
};

template<typename Read>
bool try_to(Read read) {
    try {
        read();
        return true;
    } catch (const Failure& failure) {
        const std::string_view what = failure.what();
        require(!what.empty());
        require(what.find('\n') == std::string_view::npos);
    }
    return false;
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const Limits limits;
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    if (size < Frame::bytes) return 0;
    Frame frame;
    if (try_to([&] { frame = read_frame(text, limits); })) {
        require(frame.head_bytes <= limits.head_bytes && frame.body_bytes <= limits.body_bytes);
        require(frame_text(frame) == text.substr(0, Frame::bytes));
    }
    nlohmann::json head;
    if (!try_to([&] { head = read_head(text.substr(Frame::bytes), limits); })) return 0;
    const Outgoing message = make_message(MessageKind::request, 1, head);
    nlohmann::json again;
    require(try_to([&] { again = read_head(std::string_view(message.start).substr(Frame::bytes), limits); }));
    require(again.dump(-1, ' ', true) == head.dump(-1, ' ', true)); // NaN is not equal to itself
    static const Call row =
        call<Arguments>("call", Permission::view, "", [](const Arguments&, Work&) { return Answer{}; });
    (void)try_to([&] { (void)bind(row, head); });
    return 0;
}
