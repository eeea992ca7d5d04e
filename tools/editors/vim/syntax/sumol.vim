" SPDX-License-Identifier: Apache-2.0
" Models of Obscura in SuMoL.
if exists("b:current_syntax") | finish | endif
syntax keyword sumolKeyword property parameter global if else return for
syntax keyword sumolType scalar vec2 vec3 vec4 texture void
syntax keyword sumolFunction normalize length dot cross reflect refract isnan abs sqrt floor ceil exp log log2 sin cos tan asin acos atan sign min max pow fmod atan2 step clamp mix smoothstep exp2 log10 lookup3DLOD size lookupLOD normal
syntax keyword sumolConstant M_PI M_PI_2 M_PI_4 M_1_PI M_2_PI M_2_SQRTPI M_SQRT2 M_SQRT1_2 M_E M_LN2 M_LN10 M_LOG2E M_LOG10E M_NAN
syntax match sumolNumber "\v<(0[xX]\x+|(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?)"
syntax match sumolComment "//.*$"
syntax match sumolRemark "//!.*$"
syntax region sumolComment start="/\*" end="\*/"
highlight default link sumolKeyword Keyword
highlight default link sumolType Type
highlight default link sumolFunction Function
highlight default link sumolConstant Constant
highlight default link sumolNumber Number
highlight default link sumolComment Comment
highlight default link sumolRemark SpecialComment
let b:current_syntax = "sumol"
