// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

namespace organbake {

// Takes four letters of base64 (RFC 4648; white space is passed over) off the text and adds the one
// to three bytes that they stand for. False, with nothing added, where there are no four.
bool take_base64_group(std::string_view& text, std::string& bytes);

}  // namespace organbake
