# SPDX-License-Identifier: GPL-3.0-or-later
# cmake -DFILES="a.schema.json;…" -DOUTPUT=x.cpp -P EmbedFiles.cmake
# Writes the source of embedded_files(): each file as a raw string.
set(entries "")
foreach(file IN LISTS FILES)
  get_filename_component(name ${file} NAME)
  file(READ ${file} text)
  string(APPEND entries "      {\"${name}\", R\"~file~(${text})~file~\"},\n")
endforeach()
file(WRITE ${OUTPUT}
"// SPDX-License-Identifier: GPL-3.0-or-later
#include \"embedded_files.h\"

namespace organbake {

const std::vector<EmbeddedFile>& embedded_files() {
  static const std::vector<EmbeddedFile> files = {
${entries}  };
  return files;
}

}  // namespace organbake
")
