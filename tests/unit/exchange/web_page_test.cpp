// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/exchange/web_page.h"

#include <gmock/gmock.h>
#include <libdeflate.h>

#include <cmath>

#include "organ_to_export.h"
#include "organbake/bundle/bundle_pack.h"
#include "organbake/bundle/map_code.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_folder.h"
#include "organbake/player/orbit.h"
#include "organbake/player/player.h"
#include "support/error_message.h"

namespace organbake {
namespace {

std::vector<std::byte> inflated(std::span<const std::byte> pack, const PackPart& part) {
  std::vector<std::byte> bytes(part.bytes);
  libdeflate_decompressor* const decompressor = libdeflate_alloc_decompressor();
  const auto result =
      libdeflate_gzip_decompress(decompressor, pack.data() + part.offset, part.packed_bytes,
                                 bytes.data(), bytes.size(), nullptr);
  libdeflate_free_decompressor(decompressor);
  EXPECT_EQ(result, LIBDEFLATE_SUCCESS);
  return bytes;
}

Bundle through_pack(const Bundle& bundle) {
  const auto pack = web_pack(bundle);
  const auto parts = contents_of_pack(pack, pack.size());
  Bundle again = unpacked_frame(inflated(pack, parts[0]));
  for (std::size_t c = 0; c < again.maps.size(); ++c)
    again.maps[c] = decoded_maps(inflated(pack, parts[1 + c]), again.cameras.cameras[c].intrinsics,
                                 shell_face_count(again), "maps");
  return again;
}

Rgb8Image drawn(Bundle bundle) {
  Player player(std::move(bundle));
  Frame frame;
  player.draw(orbit_view(player.bundle().cameras, {0.3, 0.2}, 320, 240), {}, frame);
  return frame.color;
}

TEST(WebPack, ShowsTheOrganAsTheBundleDoes) {
  const Rgb8Image own = drawn(organ_to_export()), packed = drawn(through_pack(organ_to_export()));
  double squares = 0;
  for (std::size_t i = 0; i < own.pixels.size(); ++i)
    squares += std::pow(own.pixels[i] - packed.pixels[i], 2);
  const double psnr_db =
      10 * std::log10(255.0 * 255 * static_cast<double>(own.pixels.size()) / squares);
  EXPECT_GT(psnr_db, 55);  // what the page is promised for, its arithmetic included
}

TEST(WebPack, IsTheSameEveryTime) {
  EXPECT_EQ(web_pack(organ_to_export()), web_pack(organ_to_export()));
}

TEST(WebPage, HoldsEverythingAndNothingOfATemplate) {
  Bundle bundle = organ_to_export();
  bundle.manifest.name = "a <b> & {{pack}}";
  WebPlayer player{
      "<title>{{title}}</title>{{style}}{{loader}}{{script}}{{module}}|{{pack}}|{{provenance}}",
      "S{{x}}",
      "L;  // l\n  // licence\n\n  M(\"//\");\n",
      "J",
      {},
      {}};
  player.module.assign(1000, std::byte{7});
  const std::string page = web_page(bundle, player);
  EXPECT_THAT(page,
              testing::StartsWith(
                  "<title>a &lt;b&gt; &amp; {{pack}}</title>S{{x}}L;  // l\nM(\"//\");\nJH4sI"));
  EXPECT_GT(page.size(), 100'000u);
}

TEST(WebPage, SaysHowTheModuleIsBuilt) {
  const TemporaryFolder folder;
  EXPECT_THAT(message_of(ExitCode::no_input, [&] { read_web_player(folder.path()); }),
              testing::HasSubstr("scripts/build web"));
}

}  // namespace
}  // namespace organbake
