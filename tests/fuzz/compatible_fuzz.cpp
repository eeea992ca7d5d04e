// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: messages of the compatible protocol from anywhere, in one piece and in parts. Whatever
// they hold, they are read or refused in one line; what was read is written and read back as the same, and
// makes the arguments of a command or a refusal.
#include "service/compatible/arguments.hpp"
#include "service/compatible/codec.hpp"
#include "service/failure.hpp"
#include "tests/fuzz/scratch_folder.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

using namespace obscura::service;
using namespace obscura::service::compatible;
using obscura::test::require;

namespace {

/// The first message of `text`, which comes in parts of `part` bytes; none: it is broken or not complete.
std::optional<Fields> read(std::string_view text, std::size_t part) {
    Decoder decoder({});
    std::size_t at = 0;
    try {
        for (std::size_t end = 0; end < text.size() && !decoder.complete();) {
            end = std::min(end + part, text.size());
            const std::size_t taken = decoder.read(text.substr(at, end - at));
            require(taken <= end - at);
            at += taken;
        }
    } catch (const Failure& failure) {
        const std::string_view what = failure.what();
        require(!what.empty() && what.find('\n') == std::string_view::npos);
        return std::nullopt;
    }
    if (!decoder.complete()) return std::nullopt;
    require(decoder.bytes() == at);
    return decoder.take();
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    const std::optional<Fields> whole = read(text, std::max<std::size_t>(size, 1));
    const std::optional<Fields> parts = read(text, 3);
    require(whole.has_value() == parts.has_value());
    if (!whole) return 0;
    const std::string written = encode(*whole);
    require(encode(*parts) == written); // NaN is not equal to itself
    const std::optional<Fields> again = read(written, written.size());
    require(again.has_value() && encode(*again) == written);
    for (const Command& command : commands())
        try {
            const Arguments arguments(command, *whole);
            for (const Argument& argument : command.arguments)
                if (argument.type == ArgumentType::vector) (void)arguments.vector(argument.name, 3);
        } catch (const Failure& failure) {
            require(std::string_view(failure.what()).starts_with(command.name));
        }
    return 0;
}
