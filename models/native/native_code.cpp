// SPDX-License-Identifier: Apache-2.0
#include "models/native/native_code.hpp"

#include "models/native/wide.hpp"

#include <fmt/format.h>

#include <bit>
#include <optional>
#include <utility>

namespace obscura::models {
namespace {

using native::Emitter;
using native::Wide;
using native::WideMask;

/// Makes the loop over lanes of one program.
class CodeMaker {
public:
    CodeMaker(Emitter& emitter, const std::vector<Instruction>& instructions,
              const std::vector<Operand>& outputs)
        : e_(emitter), instructions_(instructions), outputs_(outputs) {}

    /// Returns false: the program has an operation without machine code.
    bool make() {
        auto& cc = e_.cc;
        asmjit::FuncNode* const function =
            cc.addFunc(asmjit::FuncSignatureT<void, const double*, const double* const*, double* const*,
                                              std::size_t, const double*>(asmjit::CallConvId::kCDecl));
        function->frame().setAvxEnabled();
        // Callers are SSE code, which waits for the upper halves of registers while they are not zero.
        function->frame().setAvxCleanup();
        if (e_.is_avx512) function->frame().setAvx512Enabled();
        uniforms_ = cc.newUIntPtr();
        inputs_ = cc.newUIntPtr();
        const asmjit::x86::Gp outputs = cc.newUIntPtr(), lanes = cc.newUIntPtr();
        e_.constants_base = cc.newUIntPtr();
        const asmjit::x86::Gp all[]{uniforms_, inputs_, outputs, lanes, e_.constants_base};
        for (std::uint32_t i = 0; i < 5; ++i)
            function->setArg(i, all[i]);
        lane_ = cc.newUIntPtr();
        cc.xor_(lane_, lane_);
        const asmjit::Label loop = cc.newLabel();
        cc.bind(loop);
        for (const Instruction& i : instructions_)
            if (!instruction(i)) return false;
        for (std::size_t k = 0; k < outputs_.size(); ++k) {
            const asmjit::x86::Gp row = cc.newUIntPtr();
            cc.mov(row, asmjit::x86::qword_ptr(outputs, static_cast<std::int32_t>(8 * k)));
            cc.emit(asmjit::x86::Inst::kIdVmovupd, lanes_of(row), number(outputs_[k]).loaded(e_));
        }
        cc.add(lane_, e_.is_avx512 ? 8 : 4);
        cc.cmp(lane_, lanes);
        cc.jb(loop);
        cc.ret();
        cc.endFunc();
        return cc.finalize() == asmjit::kErrorOk;
    }

private:
    struct Slot {
        std::optional<Wide> number;
        std::optional<WideMask> mask;
    };

    [[nodiscard]] asmjit::x86::Mem lanes_of(const asmjit::x86::Gp& row) const {
        return e_.is_avx512 ? asmjit::x86::zmmword_ptr(row, lane_, 3)
                            : asmjit::x86::ymmword_ptr(row, lane_, 3);
    }

    Wide number(const Operand& o) {
        switch (o.kind) {
        case Operand::Kind::uniform:
            return {e_, e_.at(uniforms_, static_cast<std::size_t>(o.index))};
        case Operand::Kind::slot: {
            Slot& slot = slots_[static_cast<std::size_t>(o.index)];
            if (!slot.number) slot.number = native::number_of(*slot.mask);
            return *slot.number;
        }
        case Operand::Kind::input:
            break;
        }
        const auto index = static_cast<std::size_t>(o.index);
        if (rows_.size() <= index) rows_.resize(index + 1);
        if (!rows_[index]) {
            const asmjit::x86::Gp row = e_.cc.newUIntPtr();
            e_.cc.mov(row, asmjit::x86::qword_ptr(inputs_, static_cast<std::int32_t>(8 * index)));
            const asmjit::x86::Vec loaded = e_.new_vector();
            e_.cc.emit(asmjit::x86::Inst::kIdVmovupd, loaded, lanes_of(row));
            rows_[index] = Wide(e_, loaded);
        }
        return *rows_[index];
    }

    WideMask mask(const Operand& o) {
        if (o.kind == Operand::Kind::slot)
            if (const Slot& slot = slots_[static_cast<std::size_t>(o.index)]; slot.mask) return *slot.mask;
        return native::is_true(e_, number(o));
    }
    [[nodiscard]] bool is_mask(const Operand& o) const {
        return o.kind == Operand::Kind::slot && slots_[static_cast<std::size_t>(o.index)].mask.has_value();
    }

    /// An operand of an operation that needs one in a register.
    Wide in_register(const Operand& o) { return {e_, number(o).loaded(e_)}; }

    /// Returns false: the operation has no machine code.
    bool instruction(const Instruction& i) {
        const auto at = static_cast<std::size_t>(i.slot);
        if (slots_.size() <= at) slots_.resize(at + 1);
        Slot result{arithmetic(i), {}};
        if (!result.number) result.mask = condition(i);
        if (!result.number && !result.mask) result.number = function(i);
        slots_[at] = result;
        return result.number || result.mask;
    }

    std::optional<Wide> arithmetic(const Instruction& i) {
        const auto& o = i.operands;
        switch (i.operation) {
        case Operation::add:
            return number(o[0]) + number(o[1]);
        case Operation::subtract:
            return number(o[0]) - number(o[1]);
        case Operation::multiply:
            return number(o[0]) * number(o[1]);
        case Operation::divide:
            return number(o[0]) / number(o[1]);
        case Operation::minimum:
            return native::smaller(number(o[0]), number(o[1]));
        case Operation::maximum:
            return native::larger(number(o[0]), number(o[1]));
        case Operation::negate:
            return -in_register(o[0]);
        case Operation::absolute:
            return native::absolute(in_register(o[0]));
        case Operation::square_root:
            return native::square_root(in_register(o[0]));
        case Operation::round_down:
            return native::round_down(in_register(o[0]));
        case Operation::select:
            if (is_mask(o[1]) || is_mask(o[2])) return {};
            return native::select(mask(o[0]), number(o[1]), number(o[2]));
        default:
            return {};
        }
    }

    std::optional<WideMask> condition(const Instruction& i) {
        const auto& o = i.operands;
        switch (i.operation) {
        case Operation::less:
            return number(o[0]) < number(o[1]);
        case Operation::less_or_equal:
            return number(o[0]) <= number(o[1]);
        case Operation::equal:
            return number(o[0]) == number(o[1]);
        case Operation::both:
            return mask(o[0]) & mask(o[1]);
        case Operation::either:
            return mask(o[0]) | mask(o[1]);
        case Operation::invert:
            return !mask(o[0]);
        case Operation::select:
            return native::select(mask(o[0]), mask(o[1]), mask(o[2]));
        default:
            return {};
        }
    }

    /// Nothing for the remainder of a division, which takes as many steps as its exponents differ.
    std::optional<Wide> function(const Instruction& i) {
        const auto& o = i.operands;
        Wide sine = 0.0, cosine = 0.0;
        switch (i.operation) {
        case Operation::power:
            return model_pow(in_register(o[0]), in_register(o[1]));
        case Operation::arc_tangent_2:
            return vector_atan2(in_register(o[0]), in_register(o[1]));
        case Operation::exponential:
            return model_exp(in_register(o[0]));
        case Operation::logarithm:
            return model_log(in_register(o[0]));
        case Operation::arc_sine:
            return vector_asin(in_register(o[0]));
        case Operation::arc_cosine:
            return vector_acos(in_register(o[0]));
        case Operation::arc_tangent:
            return vector_atan(in_register(o[0]));
        case Operation::sine:
            return vector_sincos(in_register(o[0]), sine, cosine), sine;
        case Operation::cosine:
            return vector_sincos(in_register(o[0]), sine, cosine), cosine;
        case Operation::tangent:
            return vector_sincos(in_register(o[0]), sine, cosine), sine / cosine;
        default:
            return {};
        }
    }

    Emitter& e_;
    const std::vector<Instruction>& instructions_;
    const std::vector<Operand>& outputs_;
    asmjit::x86::Gp uniforms_, inputs_, lane_;
    std::vector<Slot> slots_;
    std::vector<std::optional<Wide>> rows_;
};

} // namespace

NativeTarget native_target() noexcept {
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl"))
        return NativeTarget::avx512;
    if (__builtin_cpu_supports("avx2")) return NativeTarget::avx2;
#endif
    return NativeTarget::none;
}

std::unique_ptr<const NativeCode> NativeCode::make(const std::vector<Instruction>& instructions,
                                                   const std::vector<Operand>& outputs, NativeTarget target,
                                                   std::string& why) {
    if (target == NativeTarget::none) return why = "the processor has no AVX2", nullptr;
    if (instructions.size() > max_instructions)
        return why = fmt::format("more than {} operations", max_instructions), nullptr;
    asmjit::CodeHolder code;
    asmjit::Error error = code.init(asmjit::Environment::host());
    asmjit::x86::Compiler compiler;
    if (error == asmjit::kErrorOk) error = code.attach(&compiler);
    if (error != asmjit::kErrorOk) return why = asmjit::DebugUtils::errorAsString(error), nullptr;
    Emitter emitter(compiler, target == NativeTarget::avx512);
    if (!CodeMaker(emitter, instructions, outputs).make())
        return why = "an operation has no machine code", nullptr;
    // Nothing outside is referred to: the code can lie anywhere.
    error = code.flatten();
    if (error == asmjit::kErrorOk) error = code.resolveUnresolvedLinks();
    std::vector<std::uint8_t> bytes(code.codeSize());
    if (error == asmjit::kErrorOk) error = code.copyFlattenedData(bytes.data(), bytes.size());
    if (error != asmjit::kErrorOk) return why = asmjit::DebugUtils::errorAsString(error), nullptr;

    std::unique_ptr<NativeCode> native(new NativeCode);
    native->code_ = SealedCode(bytes, why);
    if (native->code_.entry() == nullptr) return nullptr;
    for (const std::uint64_t bits : emitter.constants)
        native->constants_.emplace_back(std::bit_cast<double>(bits));
    return native;
}

void NativeCode::run(const std::vector<Copies>& uniforms, const double* const* inputs, double* const* outputs,
                     std::size_t lanes) const noexcept {
    const auto entry = reinterpret_cast<Entry>(const_cast<void*>(code_.entry()));
    entry(uniforms.data(), inputs, outputs, lanes, constants_.data());
}

} // namespace obscura::models
