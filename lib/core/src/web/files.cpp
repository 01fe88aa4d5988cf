// SPDX-License-Identifier: Apache-2.0
// A page has no files: what asks for one by name is told so.
#include "organbake/core/files.h"
#include "organbake/core/error.h"

namespace organbake {

std::string read_text_file(const std::filesystem::path& path, std::size_t) {
  throw NoInputError(path, "a page cannot open files; write what it holds into the document");
}

}  // namespace organbake
