// SPDX-License-Identifier: Apache-2.0
// The one source that is compiled anew when a version is cut.
#include "organbake/core/version.h"

namespace organbake {

const char* const kVersion = ORGANBAKE_VERSION;
const char* const kReleaseDate = ORGANBAKE_RELEASE_DATE;

}  // namespace organbake
