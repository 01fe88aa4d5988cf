// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace organbake {

// "; did you mean 'faces'?" when one of the candidates is close to `name`, whatever their case,
// else nothing. To be put at the end of an error message.
std::string suggestion(std::string_view name, const std::vector<std::string>& candidates);

}  // namespace organbake
