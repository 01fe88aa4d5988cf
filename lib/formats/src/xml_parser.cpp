// SPDX-License-Identifier: GPL-3.0-or-later
// Expat's callbacks as virtual functions, for the readers of VTK's and OpenCV's XML.
#include "xml_parser.h"

#include <new>
#include <utility>

#include "organbake/core/error.h"

namespace organbake {
namespace {

// Where it stopped. Since 2.9 (Debian 13), expat's own name for it is deprecated.
auto line_number(XML_Parser parser) {
#if XML_MAJOR_VERSION > 2 || XML_MINOR_VERSION >= 9
  return XML_GetCurrentLineNumber64(parser);
#else
  return XML_GetCurrentLineNumber(parser);
#endif
}

}  // namespace

XmlParser::XmlParser(const std::filesystem::path& path)
    : path_(path), parser_(XML_ParserCreate(nullptr)) {
  if (!parser_) throw std::bad_alloc();
  XML_SetUserData(parser_.get(), this);
  XML_SetElementHandler(
      parser_.get(),
      [](void* self, const XML_Char* name, const XML_Char** attributes) {
        XmlAttributes all;
        for (; *attributes; attributes += 2) all[attributes[0]] = attributes[1];
        static_cast<XmlParser*>(self)->open(name, std::move(all));
      },
      [](void* self, const XML_Char*) { static_cast<XmlParser*>(self)->close(); });
  XML_SetCharacterDataHandler(parser_.get(), [](void* self, const XML_Char* characters, int count) {
    static_cast<XmlParser*>(self)->add({characters, static_cast<std::size_t>(count)});
  });
}

void XmlParser::parse(std::string_view xml, bool whole) {
  constexpr std::size_t kLargest = std::size_t{1} << 30;  // expat counts in ints
  if (xml.size() > kLargest)
    throw BadDataError(path_, "its XML is larger than 1 GB; save it with appended data");
  if (XML_Parse(parser_.get(), xml.data(), static_cast<int>(xml.size()), whole) == XML_STATUS_OK)
    return;
  throw BadDataError(path_, "is no sound XML: line " + std::to_string(line_number(parser_.get())) +
                                ": " + XML_ErrorString(XML_GetErrorCode(parser_.get())));
}

}  // namespace organbake
