// SPDX-License-Identifier: Apache-2.0
#include "organbake/bundle/bundle_pack.h"

#include <gmock/gmock.h>

#include "organbake/core/random.h"
#include "support/error_message.h"
#include "support/synthetic_bundle.h"

namespace organbake {
namespace {

const std::vector<PackPart> kSomeParts = {{0, 100, 1000}, {0, 7, 20}, {0, 50, 50}};

TEST(PackContents, ComeBackWithOffsets) {
  const auto bytes = pack_contents(kSomeParts);
  ASSERT_EQ(bytes.size(), pack_contents_bytes(kSomeParts.size()));
  const auto parts = contents_of_pack(bytes, bytes.size() + 157);
  ASSERT_EQ(parts.size(), 3u);
  EXPECT_EQ(parts[0].offset, bytes.size());
  EXPECT_EQ(parts[2].offset, bytes.size() + 107);
  EXPECT_EQ(parts[1].packed_bytes, 7u);
  EXPECT_EQ(parts[1].bytes, 20u);
}

TEST(PackContents, RefuseWhateverWasChanged) {
  const auto bytes = pack_contents(kSomeParts);
  const std::size_t total = bytes.size() + 157;
  EXPECT_THROW(contents_of_pack(bytes, total + 1), BadDataError);
  for (std::size_t length = 0; length < bytes.size(); ++length)
    EXPECT_THROW(contents_of_pack(std::span(bytes).first(length), total), BadDataError);
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    auto changed = bytes;
    changed[bit / 8] ^= std::byte(1u << bit % 8);
    EXPECT_THROW(contents_of_pack(changed, total), BadDataError) << bit;
  }
}

TEST(PackContents, RefuseAPartThatNoStreamInflatesTo) {
  const auto bytes = pack_contents({{0, 10, 4'000'000'000u}, {0, 1, 1}});
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { contents_of_pack(bytes, bytes.size() + 11); }),
              testing::HasSubstr("inflates"));
}

TEST(PackedFrame, ComesBack) {
  const Bundle bundle = small_bundle();
  const Bundle again = unpacked_frame(packed_frame(bundle));
  EXPECT_EQ(again.manifest.name, "small");
  EXPECT_EQ(again.proxy.vertices, bundle.proxy.vertices);
  EXPECT_EQ(again.proxy.faces, bundle.proxy.faces);
  ASSERT_EQ(again.cameras.cameras.size(), 2u);
  EXPECT_EQ(again.cameras.manifold.directions, bundle.cameras.manifold.directions);
  EXPECT_EQ(again.mechanics.mass_kg, bundle.mechanics.mass_kg);
  EXPECT_EQ(again.base.color, bundle.base.color);
  EXPECT_EQ(again.base.seen_by, bundle.base.seen_by);
  for (std::size_t i = 0; i < bundle.base.height_mm.size(); ++i)
    EXPECT_NEAR(again.base.height_mm[i], bundle.base.height_mm[i], 0.5 / 1024);
}

TEST(PackedFrame, RefusesOrReadsWhateverStandsThere) {
  const auto bytes = packed_frame(small_bundle());
  RandomStream random(9);
  int refused = 0;
  for (int m = 0; m < 2000; ++m) {
    auto changed = bytes;
    if (m % 4 == 0) changed.resize(random.below(changed.size()));
    for (std::uint64_t i = 0; i <= random.below(5) && !changed.empty(); ++i)
      changed[random.below(changed.size())] = std::byte(random.below(256));
    try {
      EXPECT_FALSE(unpacked_frame(changed).proxy.faces.empty());
    } catch (const BadDataError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 1000);
}

}  // namespace
}  // namespace organbake
