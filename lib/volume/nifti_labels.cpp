// SPDX-License-Identifier: GPL-3.0-or-later
#include "volume/nifti_labels.h"

#include <algorithm>
#include <charconv>
#include <string>

#include "volume/header_text.h"

namespace organbake {
namespace {

constexpr std::uint64_t kLongestExtension = std::uint64_t{1} << 22;

// The text of an element whose opening tag ends at `at`, plain or as CDATA.
std::string element_text(const std::string& xml, std::size_t at) {
  constexpr std::string_view kOpen = "<![CDATA[", kClose = "]]>";
  at = xml.find_first_not_of(" \t\r\n", at);
  if (at == std::string::npos) return {};
  if (xml.compare(at, kOpen.size(), kOpen) == 0) {
    at += kOpen.size();
    return trimmed(xml.substr(at, xml.find(kClose, at) - at));
  }
  return trimmed(xml.substr(at, xml.find('<', at) - at));
}

}  // namespace

std::vector<LabelName> read_nifti_labels(ByteStream& stream, std::uint64_t& left) {
  std::string xml(static_cast<std::size_t>(std::min(left, kLongestExtension)), '\0');
  stream.read_exactly(std::as_writable_bytes(std::span(xml)));
  left -= xml.size();
  std::vector<LabelName> names;
  constexpr std::string_view kElement = "<Label ", kKey = "Key=\"";
  for (std::size_t at = 0; (at = xml.find(kElement, at)) != std::string::npos;) {
    const std::size_t close = xml.find('>', at), key = xml.find(kKey, at);
    at += kElement.size();
    if (close == std::string::npos || key > close) continue;
    int label = 0;
    const char* first = xml.data() + key + kKey.size();
    const auto [end, error] = std::from_chars(first, xml.data() + close, label);
    const std::string name = element_text(xml, close + 1);
    if (error == std::errc() && end != first && label > 0 && !name.empty()) {
      names.push_back({label, name});
    }
  }
  return names;
}

}  // namespace organbake
