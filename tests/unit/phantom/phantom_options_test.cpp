// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <limits>

#include "organbake/core/error.h"
#include "organbake/phantom/phantom.h"

namespace organbake {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST(OrganPhantomOptions, DefaultsAreValid) { EXPECT_NO_THROW(OrganPhantomOptions().check()); }

template <class Change>
void expect_refused(Change change) {
  OrganPhantomOptions options;
  change(options);
  EXPECT_THROW(options.check(), UsageError);
  EXPECT_THROW(OrganPhantom{options}, UsageError);
}

TEST(OrganPhantomOptions, EachBoundIsKept) {
  expect_refused([](auto& o) { o.ct_size[0] = 7; });
  expect_refused([](auto& o) { o.ct_size[2] = 2049; });
  expect_refused([](auto& o) { o.ct_size[1] = -256; });
  expect_refused([](auto& o) { o.spacing_mm[0] = 0; });
  expect_refused([](auto& o) { o.spacing_mm[1] = 51; });
  expect_refused([](auto& o) { o.spacing_mm[2] = kNaN; });
  expect_refused([](auto& o) { o.noise_hu = -1; });
  expect_refused([](auto& o) { o.noise_hu = 501; });
  expect_refused([](auto& o) { o.noise_hu = kNaN; });
  expect_refused([](auto& o) { o.photo_count = -1; });
  expect_refused([](auto& o) { o.photo_count = 1001; });
  expect_refused([](auto& o) { o.photo_size = 15; });
  expect_refused([](auto& o) { o.photo_size = 16385; });
}

TEST(OrganPhantomOptions, MessageNamesOptionValueAndBound) {
  OrganPhantomOptions options;
  options.spacing_mm[2] = 77;
  try {
    options.check();
    FAIL() << "accepted";
  } catch (const UsageError& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("spacing_mm along z = 77"), std::string::npos) << message;
    EXPECT_NE(message.find("0.05…50"), std::string::npos) << message;
  }
}

TEST(OrganPhantomOptions, TheSmallestOrganIsStillAnOrgan) {
  OrganPhantomOptions options;
  options.ct_size = {8, 8, 8};
  options.spacing_mm = {0.05, 0.05, 0.05};
  const OrganPhantom phantom(options);
  EXPECT_GT(signed_volume(phantom.surface(3)), 0);
  EXPECT_EQ(phantom.scan().voxels.size(), 512u);
}

}  // namespace
}  // namespace organbake
