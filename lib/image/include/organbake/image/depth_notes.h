// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace organbake {

// What a depth map of a frame says of itself (ExrWriteOptions::notes), for who brings it together
// with poses from elsewhere.
inline constexpr const char* kDepthUnitNote = "depthUnit";
inline constexpr const char* kRelativeDepth = "relative";  // of this map alone; else mm
inline constexpr const char* kLensNote = "lens";
inline constexpr const char* kAssumedLens = "assumed";  // a field of view nobody measured
inline constexpr const char* kWorldNote = "world";
inline constexpr const char* kScopesOwnAxes = "scope";  // camera_from_world begins at the scope

}  // namespace organbake
