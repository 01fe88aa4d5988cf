# SPDX-License-Identifier: GPL-3.0-or-later
# cmake -DFILES="a.schema.json;…" -DOUTPUT=x.cpp -P EmbedSchemas.cmake
# Writes the source of embedded_schemas(): each file as a raw string.
set(entries "")
foreach(file IN LISTS FILES)
  get_filename_component(name ${file} NAME)
  string(REPLACE ".schema.json" "" name ${name})
  file(READ ${file} text)
  string(APPEND entries "      {\"${name}\", R\"~schema~(${text})~schema~\"},\n")
endforeach()
file(WRITE ${OUTPUT}
"// SPDX-License-Identifier: GPL-3.0-or-later
#include \"pipelines/embedded_schemas.h\"

namespace organbake {

const std::vector<EmbeddedSchema>& embedded_schemas() {
  static const std::vector<EmbeddedSchema> schemas = {
${entries}  };
  return schemas;
}

}  // namespace organbake
")
