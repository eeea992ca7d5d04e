" SPDX-License-Identifier: Apache-2.0
autocmd BufRead,BufNewFile *.brdf,*.mot,*.txr,*.psf,*.prj,*.shp,*.sns,*.tim setfiletype sumol | compiler obscura_model
