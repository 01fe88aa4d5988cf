// SPDX-License-Identifier: Apache-2.0
#include "support/places.h"

namespace organbake {

std::filesystem::path in_clone(const std::filesystem::path& below) {
  return std::filesystem::path(ORGANBAKE_SOURCE_DIR) / below;
}

std::filesystem::path shared_data(const std::filesystem::path& below) {
  return std::filesystem::path(ORGANBAKE_SHARED_DATA) / below;
}

}  // namespace organbake
