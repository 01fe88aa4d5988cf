// SPDX-License-Identifier: Apache-2.0
#include "organbake/player/embedded_player.h"

#include <gtest/gtest.h>

#include <cmath>

#include "organbake/core/error.h"

namespace organbake {
namespace {

// What it does with a bundle is tested from outside: tests/cli/consumer.sh.
TEST(EmbeddedPlayer, AMissingBundleIsNamed) {
  EXPECT_THROW(EmbeddedPlayer("no/such/bundle"), NoInputError);
}

TEST(EmbeddedPlayer, ABadTimeStepIsSaidBeforeTheBundleIsRead) {
  EXPECT_THROW(EmbeddedPlayer("no/such/bundle", 0), UsageError);
  EXPECT_THROW(EmbeddedPlayer("no/such/bundle", std::nan("")), UsageError);
}

}  // namespace
}  // namespace organbake
