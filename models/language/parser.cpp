// SPDX-License-Identifier: Apache-2.0
#include "models/language/parser.hpp"

#include "core/text/printable.hpp"
#include "models/language/expressions.hpp"
#include "models/language/token_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace obscura::models {
namespace {

class Parser {
public:
    Parser(const std::vector<Token>& tokens, Findings& findings) : reader_(tokens, findings) {}

    SyntaxTree file() {
        while (!reader_.at_end() && !reader_.findings().full()) {
            try {
                declaration();
            } catch (const Unreadable&) {
                nesting_ = 0;
                reader_.skip_statement();
                // A "}" that closes nothing here.
                while (reader_.take("}")) {
                }
            }
        }
        return std::move(tree_);
    }

private:
    void declaration() {
        using Kind = Declaration::Kind;
        for (const auto& [word, kind] : {std::pair{"property", Kind::property},
                                         {"parameter", Kind::parameter},
                                         {"global", Kind::global}})
            if (reader_.take(word)) return value_declaration(kind);
        const Place at = reader_.token().at;
        if (reader_.is("void")) reader_.fail(at, "a function returns a value: scalar, vec2, vec3 or vec4");
        const std::optional<Type> type = reader_.take_type();
        if (!type)
            reader_.fail(at,
                         fmt::format("found {}: allowed are property, parameter, global and functions that "
                                     "begin with scalar, vec2, vec3 or vec4",
                                     reader_.found()));
        function(*type);
    }

    void value_declaration(Declaration::Kind kind) {
        Declaration d;
        d.kind = kind;
        const bool texture = kind == Declaration::Kind::parameter && reader_.take("texture");
        d.at = reader_.token().at;
        d.name = reader_.expect_name("a name");
        if (texture)
            d.value.type = Type::texture;
        else
            d.value = constant();
        const Token& end = reader_.token();
        reader_.expect_end_of_statement(fmt::format("behind '{}'", d.name));
        d.remark = end.remark;
        if (tree_.declarations.size() >= max_declared)
            reader_.fail(d.at, fmt::format("more than {} properties, parameters and globals", max_declared));
        tree_.declarations.push_back(d);
    }

    /// true, false, a number with or without sign, vecN(number, ...).
    Default constant() {
        const Token& t = reader_.token();
        if (reader_.take("true")) return {Type::scalar, {1}};
        if (reader_.take("false")) return {Type::scalar, {0}};
        for (const Type type : {Type::vec2, Type::vec3, Type::vec4}) {
            if (!reader_.take(name_of(type))) continue;
            reader_.expect("(", fmt::format("behind {}", name_of(type)));
            Default d{type, {}};
            const auto count = static_cast<std::size_t>(components(type));
            std::size_t given = 0;
            do {
                const double value = signed_number();
                if (given < count) d.value[given] = value;
                ++given;
            } while (reader_.take(","));
            reader_.expect(")", "behind the components");
            if (given == 1)
                std::fill_n(d.value.begin(), count, d.value[0]);
            else if (given != count)
                reader_.findings().error(
                    t.at, fmt::format("{} components: {} has {}, or 1 for all", given, name_of(type), count));
            return d;
        }
        return {Type::scalar, {signed_number()}};
    }

    double signed_number() {
        const bool negative = reader_.take("-");
        const Token& t = reader_.token();
        if (t.kind != Token::Kind::number)
            reader_.fail(t.at, fmt::format("a number is missing, found {}: write for example 0.5 or vec4(1)",
                                           reader_.found()));
        reader_.take();
        return negative ? -t.value : t.value;
    }

    void function(Type type) {
        Function f;
        f.type = type;
        f.at = reader_.token().at;
        f.name = reader_.expect_name("the name of a function");
        if (type == Type::texture) reader_.findings().error(f.at, "a function cannot return a texture");
        if (!reader_.is("("))
            reader_.fail(f.at,
                         fmt::format("'{}' is no function: values at file level are declared with parameter "
                                     "or global, or inside a function",
                                     printable(f.name)));
        reader_.take();
        while (!reader_.is(")")) {
            Argument a;
            const Place at = reader_.token().at;
            const std::optional<Type> argument_type = reader_.take_type();
            if (!argument_type)
                reader_.fail(at,
                             fmt::format("the type of an argument is missing, found {}", reader_.found()));
            a.type = *argument_type;
            a.normalised = reader_.take("$");
            a.at = reader_.token().at;
            a.name = reader_.expect_name("the name of an argument");
            f.arguments.push_back(a);
            if (!reader_.take(",")) break;
        }
        reader_.expect(")", fmt::format("behind the arguments of {}", f.name));
        if (!reader_.is("{"))
            reader_.fail(reader_.token().at, fmt::format("the body of {} is missing", f.name));
        f.body = statement();
        if (tree_.functions.size() >= max_declared)
            reader_.fail(f.at, fmt::format("more than {} functions", max_declared));
        tree_.functions.push_back(std::move(f));
    }

    /// One statement; what cannot be read is noted and skipped.
    Statement statement() {
        const Nesting nested(reader_, nesting_, max_nesting);
        const Token& t = reader_.token();
        Statement s;
        s.at = t.at;
        if (reader_.take("{")) return block(std::move(s));
        if (reader_.take("if")) return branch(std::move(s));
        if (reader_.take("for")) return loop(std::move(s));
        if (reader_.take(";")) return s;
        if (reader_.take("return")) {
            s.kind = Statement::Kind::give;
            s.value = read_expression(reader_, nesting_);
        } else {
            s = simple();
        }
        reader_.expect_end_of_statement("behind the statement");
        return s;
    }

    Statement block(Statement s) {
        while (!reader_.is("}")) {
            if (reader_.at_end()) reader_.fail(s.at, "'{' has no '}'");
            if (reader_.findings().full()) throw Unreadable{};
            const int depth = nesting_;
            try {
                s.body.push_back(statement());
            } catch (const Unreadable&) {
                nesting_ = depth;
                reader_.skip_statement();
            }
        }
        reader_.take();
        return s;
    }

    Statement branch(Statement s) {
        s.kind = Statement::Kind::branch;
        reader_.expect("(", "behind 'if'");
        s.value = read_expression(reader_, nesting_);
        reader_.expect(")", "behind the condition");
        s.body.push_back(statement());
        if (reader_.take("else")) s.body.push_back(statement());
        return s;
    }

    Statement loop(Statement s) {
        s.kind = Statement::Kind::loop;
        reader_.expect("(", "behind 'for'");
        s.body.push_back(simple());
        reader_.expect(";", "behind the first part of 'for'");
        s.value = read_expression(reader_, nesting_);
        reader_.expect(";", "behind the condition of 'for'");
        s.body.push_back(simple());
        reader_.expect(")", "behind 'for'");
        s.body.push_back(statement());
        return s;
    }

    /// Declaration or assignment without its semicolon.
    Statement simple() {
        Statement s;
        s.at = reader_.token().at;
        if (const std::optional<Type> type = reader_.take_type()) {
            s.kind = Statement::Kind::declare;
            s.type = *type;
            s.at = reader_.token().at;
            s.name = reader_.expect_name("the name of a variable");
            if (reader_.take("=")) s.value = read_expression(reader_, nesting_);
            if (reader_.is(","))
                reader_.fail(reader_.token().at, "one variable in a declaration: write a second one");
            return s;
        }
        s.kind = Statement::Kind::assign;
        const bool before = reader_.is("++") || reader_.is("--");
        if (before) s.text = reader_.take().text;
        s.name = reader_.expect_name("a statement");
        if (reader_.take(".")) s.member = reader_.expect_name("a component such as x");
        if (before || reader_.is("++") || reader_.is("--")) {
            const std::string_view step = before ? s.text : reader_.take().text;
            s.text = step == "++" ? "+=" : "-=";
            s.value = std::make_unique<Expression>();
            s.value->at = s.at;
            s.value->value = 1;
            return s;
        }
        for (const std::string_view word : {"=", "+=", "-=", "*=", "/="})
            if (reader_.take(word)) {
                s.text = word;
                s.value = read_expression(reader_, nesting_);
                return s;
            }
        reader_.fail(reader_.token().at,
                     fmt::format("'=' is missing behind '{}', found {}", printable(s.name), reader_.found()));
    }

    TokenReader reader_;
    int nesting_ = 0;
    SyntaxTree tree_;
};

} // namespace

SyntaxTree parse(std::string_view source, Findings& findings) {
    if (source.size() > max_source_bytes) {
        findings.error({}, fmt::format("{} bytes: allowed are {}", source.size(), max_source_bytes));
        return {};
    }
    const std::vector<Token> tokens = tokens_of(source, findings);
    SyntaxTree tree = Parser(tokens, findings).file();
    tree.whole = !findings.has_errors();
    return tree;
}

} // namespace obscura::models
