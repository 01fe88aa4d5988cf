// SPDX-License-Identifier: GPL-3.0-or-later
// One self-contained HTML page round a bundle: the player's module, shaders and texts as base64,
// and the bundle as its pack (bundle/bundle_pack.h) by libdeflate.
#include "organbake/exchange/exchange.h"

#include <libdeflate.h>
#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <new>
#include <span>
#include <string_view>
#include <utility>

#include "organbake/bundle/bundle_pack.h"
#include "organbake/bundle/stored_maps.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/parallel.h"
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

// A script without the lines that only its readers need: whoever wants them has organ.js itself.
std::string without_comments(const std::string& script) {
  std::string result;
  for (std::size_t begin = 0; begin < script.size();) {
    const std::size_t end = std::min(script.find('\n', begin), script.size() - 1) + 1;
    const std::size_t text = std::min(script.find_first_not_of(' ', begin), end - 1);
    if (script.compare(text, 2, "//") != 0 && script[text] != '\n')
      result += script.substr(text, end - text);
    begin = end;
  }
  return result;
}

// Of 12: higher ones save 3 % in six times the time.
constexpr int kLevel = 6;

std::uint32_t size_of(const std::vector<std::byte>& bytes) {
  if (bytes.size() > std::numeric_limits<std::uint32_t>::max())
    throw BadDataError("the bundle is too large for a page");
  return static_cast<std::uint32_t>(bytes.size());
}

// A gzip stream as small as is worth waiting for.
std::vector<std::byte> gzipped(std::span<const std::byte> bytes) {
  struct Free {
    void operator()(libdeflate_compressor* compressor) const {
      libdeflate_free_compressor(compressor);
    }
  };
  const std::unique_ptr<libdeflate_compressor, Free> compressor(
      libdeflate_alloc_compressor(kLevel));
  if (!compressor) throw std::bad_alloc();
  std::vector<std::byte> packed(libdeflate_gzip_compress_bound(compressor.get(), bytes.size()));
  packed.resize(libdeflate_gzip_compress(compressor.get(), bytes.data(), bytes.size(),
                                         packed.data(), packed.size()));
  return packed;
}

}  // namespace

WebPlayer read_web_player(const fs::path& folder) {
  const fs::path module = folder / "organ.wasm";
  if (!fs::exists(module))
    throw NoInputError(module,
                       "the player for pages is not there; 'scripts/build web --packages FOLDER' "
                       "takes it from a release's files, and 'scripts/build web' compiles it (once "
                       "1.3 GB of packages, and 19 minutes of a processor)");
  const auto text = [&](const char* name) { return read_text_file(folder / name); };
  return {text("page.html"),
          text("page.css"),
          text("organ.js") + text("webgl.js"),
          text("painter.js") + text("headset.js") + text("page.js"),
          read_file(module),
          read_file(folder / "organ.glsl")};
}

std::string web_page(const Bundle& bundle, const WebPlayer& player, const RunContext& context) {
  const std::array<std::pair<std::string, std::string>, 8> texts = {
      {{"title", escape_html(bundle.manifest.name)},
       {"provenance", provenance(bundle)},
       {"style", player.style},
       {"loader", without_comments(player.loader)},
       {"script", without_comments(player.script)},
       {"module", to_base64(gzipped(player.module))},
       {"shaders", to_base64(gzipped(player.shaders))},
       {"pack", to_base64(web_pack(bundle, context))}}};
  return filled(player.page, texts);
}

std::vector<std::byte> web_pack(const Bundle& bundle, const RunContext& context) {
  const std::size_t count = 1 + bundle.maps.size();
  std::vector<std::vector<std::byte>> streams(count);
  std::vector<PackPart> parts(count);
  parallel_for(std::size_t{0}, count, [&](std::size_t p) {
    context.throw_if_cancelled();
    const std::vector<std::byte> bytes =
        p == 0 ? packed_frame(bundle)
               : coded_maps(bundle.maps[p - 1], bundle.cameras.cameras[p - 1].intrinsics);
    streams[p] = gzipped(bytes);
    parts[p] = {0, size_of(streams[p]), size_of(bytes)};
  });
  std::vector<std::byte> pack = pack_contents(parts);
  for (const auto& stream : streams) pack.insert(pack.end(), stream.begin(), stream.end());
  return pack;
}

}  // namespace organbake
