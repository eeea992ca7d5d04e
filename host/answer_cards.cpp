// SPDX-License-Identifier: Apache-2.0
#include "host/answer_cards.hpp"

#include "core/camera/frame_record.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::host {
namespace {

using Json = nlohmann::ordered_json;

std::optional<std::int64_t> whole(const Json& head, std::string_view name) {
    const auto found = head.find(name);
    if (found == head.end() || !found->is_number_integer()) return std::nullopt;
    return found->get<std::int64_t>();
}

std::string text_of(const Json& head, const char* name) {
    const auto found = head.find(name);
    return found == head.end() || !found->is_string() ? std::string() : found->get<std::string>();
}

std::optional<double> number(const Json& value) {
    return value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
}

/// Cards of the member of `head` for a field; none, if it has not the type of the field.
void add_field(images::Cards& cards, const Json& head, const RecordField<FrameAnswer>& field) {
    const auto found = head.find(field.member);
    if (found == head.end()) return;
    if (field.count > 1) {
        if (!found->is_array() || found->size() != field.count) return;
        for (std::size_t i = 0; i < field.count; ++i)
            if (const auto value = number((*found)[i]))
                cards.push_back(
                    {std::string(field.card) + field.card_ends[i], *value, std::string(field.card_help)});
    } else if (field.form != FieldForm::f64) {
        if (const auto value = whole(head, field.member))
            cards.push_back({std::string(field.card), *value, std::string(field.card_help)});
    } else if (const auto value = number(*found)) {
        cards.push_back({std::string(field.card), field.card_scale > 0 ? *value / field.card_scale : *value,
                         std::string(field.card_help)});
    }
}

/// Fields of answers in the order of their cards, those of the pose last.
std::vector<const RecordField<FrameAnswer>*> in_order() {
    std::vector<const RecordField<FrameAnswer>*> fields;
    for (const RecordField<FrameAnswer>& field : record_fields<FrameAnswer>())
        fields.push_back(&field);
    std::stable_sort(fields.begin(), fields.end(),
                     [](const auto* a, const auto* b) { return a->card_place < b->card_place; });
    return fields;
}

} // namespace

images::Cards cards_of_answer(const nlohmann::ordered_json& head) {
    images::Cards cards;
    const std::vector<const RecordField<FrameAnswer>*> fields = in_order();
    for (const RecordField<FrameAnswer>* field : fields)
        if (field->count == 1) add_field(cards, head, *field);
    cards.push_back({"TAIOFF", std::int64_t{0}, "[ns] TAI minus the clock of these times"});
    if (const auto rows = whole(head, "rows"))
        cards.push_back({"ROWS", *rows, "rows that are there, the others are 0"});
    if (const auto flags = whole(head, "flags"))
        for (const images::FlagCard& card : images::flag_cards)
            cards.push_back({std::string(card.key), (*flags & card.flag) != 0, std::string(card.comment)});
    cards.push_back({"CAMAXES", std::string("x right, y down, z boresight"), "axes of the camera"});
    cards.push_back({"QUATCONV", std::string("scalar first, own axes to inertial"), "meaning of CAM_Q"});
    for (const RecordField<FrameAnswer>* field : fields)
        if (field->count > 1) add_field(cards, head, *field);
    if (const std::string hash = text_of(head, "config_sha256");
        hash.size() == 64 && hash.find_first_not_of("0123456789abcdef") == std::string::npos)
        cards.push_back({"CFGSHA", hash, "configuration"});
    return cards;
}

} // namespace obscura::host
