" SPDX-License-Identifier: Apache-2.0
autocmd BufRead,BufNewFile *.brdf,*.mot,*.txr,*.psf,*.prj,*.sns,*.tim setfiletype sumol | compiler obscura_model
