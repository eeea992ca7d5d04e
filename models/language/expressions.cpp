// SPDX-License-Identifier: Apache-2.0
#include "models/language/expressions.hpp"

#include "models/language/parser.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

namespace obscura::models {
namespace {

/// Operators from the weakest to the strongest; those of one level associate to the left.
struct Level {
    std::array<std::string_view, 4> operators;
};
constexpr std::array<Level, 7> levels{
    {{{"||"}}, {{"&&"}}, {{"|"}}, {{"==", "!="}}, {{"<", "<=", ">", ">="}}, {{"+", "-"}}, {{"*", "/"}}}};

class ExpressionParser {
public:
    ExpressionParser(TokenReader& reader, int& nesting) : reader_(reader), nesting_(nesting) {}

    ExpressionPointer conditional() {
        const Nesting nested(reader_, nesting_, max_nesting);
        ExpressionPointer condition = binary(0);
        const Place at = reader_.token().at;
        if (!reader_.take("?")) return condition;
        ExpressionPointer yes = conditional();
        reader_.expect(":", "between the values of '?'");
        ExpressionPointer no = conditional();
        ExpressionPointer whole = make(Expression::Kind::conditional, at, "?");
        add(*whole, std::move(condition));
        add(*whole, std::move(yes));
        add(*whole, std::move(no));
        return whole;
    }

private:
    static ExpressionPointer make(Expression::Kind kind, Place at, std::string_view text, double value = 0) {
        auto e = std::make_unique<Expression>();
        e->kind = kind;
        e->at = at;
        e->text = text;
        e->value = value;
        return e;
    }
    void add(Expression& e, ExpressionPointer operand) {
        e.depth = std::max(e.depth, operand->depth + 1);
        e.operands.push_back(std::move(operand));
        if (e.depth > max_expression_depth)
            reader_.fail(e.at, fmt::format("an expression of more than {} operators in a chain: split it",
                                           max_expression_depth));
    }

    ExpressionPointer binary(std::size_t level) {
        if (level == levels.size()) return unary();
        ExpressionPointer left = binary(level + 1);
        for (;;) {
            const Token& t = reader_.token();
            const auto& words = levels[level].operators;
            if (t.kind != Token::Kind::symbol ||
                std::find(words.begin(), words.end(), t.text) == words.end()) {
                if (t.is("%") || t.is("&") || t.is("^"))
                    reader_.fail(t.at, t.is("%") ? "'%' is not used in SuMoL: write fmod(a, b)"
                                                 : fmt::format("'{}' is not used in SuMoL", t.text));
                return left;
            }
            reader_.take();
            ExpressionPointer right = binary(level + 1);
            ExpressionPointer whole = make(Expression::Kind::binary, t.at, t.text);
            add(*whole, std::move(left));
            add(*whole, std::move(right));
            left = std::move(whole);
        }
    }

    ExpressionPointer unary() {
        const Token& t = reader_.token();
        if (!t.is("-") && !t.is("+") && !t.is("!")) return postfix();
        const Nesting nested(reader_, nesting_, max_nesting);
        reader_.take();
        ExpressionPointer operand = unary();
        if (t.is("+")) return operand;
        ExpressionPointer whole = make(Expression::Kind::unary, t.at, t.text);
        add(*whole, std::move(operand));
        return whole;
    }

    ExpressionPointer postfix() {
        ExpressionPointer value = primary();
        while (reader_.is(".")) {
            reader_.take();
            const Place at = reader_.token().at;
            ExpressionPointer whole =
                make(Expression::Kind::member, at, reader_.expect_name("a component such as x"));
            add(*whole, std::move(value));
            value = std::move(whole);
        }
        if (reader_.is("["))
            reader_.fail(reader_.token().at, "there are no arrays: components are .x .y .z .w");
        return value;
    }

    ExpressionPointer primary() {
        const Token& t = reader_.token();
        if (t.kind == Token::Kind::number) {
            reader_.take();
            return make(Expression::Kind::number, t.at, t.text, t.value);
        }
        if (reader_.take("(")) {
            ExpressionPointer inner = conditional();
            reader_.expect(")", "behind the expression");
            return inner;
        }
        const bool constructor = t.is("vec2") || t.is("vec3") || t.is("vec4");
        if (!constructor && (t.kind != Token::Kind::identifier || is_keyword(t.text)))
            reader_.fail(t.at, fmt::format("a value is missing, found {}", reader_.found()));
        reader_.take();
        if (!reader_.is("(")) {
            if (constructor)
                reader_.fail(t.at, fmt::format("'{}' needs its components: {}(...)", t.text, t.text));
            return make(Expression::Kind::name, t.at, t.text);
        }
        reader_.take();
        ExpressionPointer call = make(Expression::Kind::call, t.at, t.text);
        while (!reader_.is(")")) {
            add(*call, conditional());
            if (!reader_.take(",")) break;
        }
        reader_.expect(")", fmt::format("behind the arguments of {}", t.text));
        return call;
    }

    TokenReader& reader_;
    int& nesting_;
};

} // namespace

ExpressionPointer read_expression(TokenReader& reader, int& nesting) {
    return ExpressionParser(reader, nesting).conditional();
}

} // namespace obscura::models
