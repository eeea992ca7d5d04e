// SPDX-License-Identifier: Apache-2.0
// Empty source file of the targets that hold precompiled headers (Precompiled.cmake).
