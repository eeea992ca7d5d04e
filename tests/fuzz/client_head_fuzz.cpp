// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: the head of a message as the C client reads it, from a server that means harm. What is
// read is written and read back as the same; the arrays that it describes are inside the body, or refused.
#include "tests/fuzz/scratch_folder.hpp"

extern "C" {
#include "clients/c/src/answer.h"
#include "clients/c/src/messagepack.h"
}

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>

using obscura::test::require;

namespace {

bool same(const obscura_value* a, const obscura_value* b) {
    if (obscura_type_of(a) != obscura_type_of(b) || obscura_count(a) != obscura_count(b)) return false;
    const double number = obscura_as_number(a, 0), other = obscura_as_number(b, 0);
    if (number != other && (number == number || other == other)) return false; // NaN stays NaN
    if (obscura_as_int(a, 0) != obscura_as_int(b, 0) || obscura_as_bool(a) != obscura_as_bool(b))
        return false;
    if (obscura_type_of(a) == OBSCURA_STRING)
        return std::memcmp(obscura_as_string(a), obscura_as_string(b), obscura_count(a)) == 0;
    for (std::size_t i = 0; i < obscura_count(a); ++i) {
        if (!same(obscura_at(a, i), obscura_at(b, i))) return false;
        if (obscura_type_of(a) == OBSCURA_MAP &&
            std::strcmp(obscura_name_at(a, i), obscura_name_at(b, i)) != 0)
            return false;
    }
    return true;
}

/// The answer of that head, which is taken over, to a request, and every byte of its arrays.
void read_arrays(obscura_value* head) {
    constexpr std::size_t body_bytes = 64;
    const char* why = nullptr;
    auto* const body = static_cast<unsigned char*>(std::calloc(1, body_bytes));
    obscura_answer* const answer = oc_answer_new(head, body, body_bytes, &why);
    require((answer == nullptr) == (why != nullptr));
    for (std::size_t i = 0; i < obscura_array_count(answer); ++i) {
        const obscura_array* const array = obscura_array_at(answer, i);
        const auto* const bytes = static_cast<const unsigned char*>(array->data);
        for (std::size_t at = 0; at < array->bytes; ++at)
            require(bytes[at] == 0);
    }
    obscura_answer_free(answer);
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    constexpr std::size_t frame_bytes = 24; // files of the corpus begin with one
    if (size < frame_bytes) return 0;
    const char* why = nullptr;
    obscura_value* const head = oc_unpack(data + frame_bytes, size - frame_bytes, &why);
    require((head == nullptr) == (why != nullptr));
    if (head == nullptr) return 0;
    oc_buffer packed{};
    require(oc_pack(&packed, head) == nullptr);
    obscura_value* const again = oc_unpack(packed.data, packed.size, &why);
    require(again != nullptr && same(head, again));
    obscura_value* const copy = obscura_value_copy(head);
    require(copy != nullptr && same(head, copy));
    read_arrays(copy);
    obscura_value_free(again);
    obscura_value_free(head);
    std::free(packed.data);
    return 0;
}
