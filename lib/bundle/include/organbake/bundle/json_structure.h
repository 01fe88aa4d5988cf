// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace organbake {

// Looks through a JSON document before it is read. Throws BadDataError naming it where it is nested
// deeper than any that makes sense, or has a key twice in one object, of which reading would
// silently take the last. Text that is no JSON is left for reading to refuse.
void check_json_structure(const std::string& text, const std::string& name);

}  // namespace organbake
