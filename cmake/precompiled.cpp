// SPDX-License-Identifier: Apache-2.0
// Of the targets that hold precompiled headers (Precompiled.cmake), which need a source file.
