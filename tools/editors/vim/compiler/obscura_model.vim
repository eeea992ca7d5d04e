" SPDX-License-Identifier: Apache-2.0
" :make checks the model, and the quickfix list has what is found.
if exists("current_compiler") | finish | endif
let current_compiler = "obscura_model"
CompilerSet makeprg=obscura\ model\ check\ %:S
CompilerSet errorformat=%f:%l:%c:\ %tarning:\ %m,%-G%f:\ sound:%.%#,%f:%l:%c:\ %m
