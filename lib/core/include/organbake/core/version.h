// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace organbake {

// Of the project as this was built from it: "0.6.0", and the day of that release, "2026-11-28".
extern const char* const kVersion;
extern const char* const kReleaseDate;

}  // namespace organbake
