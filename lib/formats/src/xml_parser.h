// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <expat.h>

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>

#include "organbake/formats/vtk_xml.h"

namespace organbake {

// Expat, told to whoever overrides what it tells. Its callbacks are C's: nothing may be thrown
// through them.
class XmlParser {
 public:
  explicit XmlParser(const std::filesystem::path& path);
  virtual ~XmlParser() = default;

  // `whole`: nothing follows it that is no XML. Throws BadDataError naming the path.
  void parse(std::string_view xml, bool whole);

 private:
  virtual void open(const std::string& name, XmlAttributes attributes) = 0;
  virtual void add(std::string_view characters) = 0;
  virtual void close() = 0;

  struct Free {
    void operator()(XML_Parser parser) const { XML_ParserFree(parser); }
  };
  const std::filesystem::path path_;
  const std::unique_ptr<std::remove_pointer_t<XML_Parser>, Free> parser_;
};

}  // namespace organbake
