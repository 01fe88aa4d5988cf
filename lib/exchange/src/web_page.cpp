// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/exchange/web_page.h"

#include <array>
#include <span>
#include <string_view>
#include <utility>

#include "organbake/core/base64.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {
namespace fs = std::filesystem;

void add_row(const std::string& name, const std::string& value, std::string& rows) {
  rows += "<tr><th scope=\"row\">" + escape_html(name) + "</th><td>" + escape_html(value) +
          "</td></tr>\n";
}

std::string provenance(const Bundle& bundle) {
  const Manifest& manifest = bundle.manifest;
  std::string rows;
  add_row("Organ", manifest.name, rows);
  add_row("Baked by", manifest.generator, rows);
  add_row("Cameras",
          std::to_string(bundle.cameras.cameras.size()) + ", the first of " +
              std::to_string(bundle.cameras.cameras.front().intrinsics.width) + " × " +
              std::to_string(bundle.cameras.cameras.front().intrinsics.height) + " texels",
          rows);
  add_row("Deformable proxy", std::to_string(bundle.proxy.faces.size()) + " faces", rows);
  for (const auto& [role, hash] : manifest.input_hashes) add_row(role + ", SHA-256", hash, rows);
  for (const std::string& path : manifest.edited) add_row("Edited by hand", path, rows);
  return rows;
}

// Every {{name}} of the page becomes its text; nothing else is touched, whatever the texts hold.
std::string filled(std::string_view page,
                   std::span<const std::pair<std::string, std::string>> texts) {
  std::string result;
  while (!page.empty()) {
    const std::size_t begin = page.find("{{"), end = page.find("}}", begin);
    if (begin == std::string_view::npos || end == std::string_view::npos) break;
    result += page.substr(0, begin);
    const std::string_view name = page.substr(begin + 2, end - begin - 2);
    for (const auto& [known, text] : texts)
      if (known == name) result += text;
    page.remove_prefix(end + 2);
  }
  return result += page;
}

}  // namespace

WebPlayer read_web_player(const fs::path& folder) {
  const fs::path module = folder / "organ.wasm";
  if (!fs::exists(module)) {
    throw NoInputError(module,
                       "the player for pages has not been built; 'scripts/setup --web && "
                       "scripts/build web' builds it");
  }
  return {read_text_file(folder / "page.html"), read_text_file(folder / "page.css"),
          read_text_file(folder / "organ.js"), read_text_file(folder / "page.js"),
          read_file(module)};
}

std::string web_page(const Bundle& bundle, const WebPlayer& player, const RunContext& context) {
  const std::array<std::pair<std::string, std::string>, 7> texts = {
      {{"title", escape_html(bundle.manifest.name)},
       {"provenance", provenance(bundle)},
       {"style", player.style},
       {"loader", player.loader},
       {"script", player.script},
       {"module", to_base64(gzipped(player.module))},
       {"pack", to_base64(web_pack(bundle, context))}}};
  return filled(player.page, texts);
}

}  // namespace organbake
