// SPDX-License-Identifier: Apache-2.0
#include "organbake/core/nearest_name.h"

#include <gtest/gtest.h>

namespace organbake {
namespace {

TEST(NearestName, SuggestsWhatIsClose) {
  const std::vector<std::string> names = {"faces", "method", "size"};
  EXPECT_EQ(suggestion("facs", names), "; did you mean 'faces'?");
  EXPECT_EQ(suggestion("metod", names), "; did you mean 'method'?");
  EXPECT_EQ(suggestion("siez", names), "; did you mean 'size'?");
  EXPECT_EQ(suggestion("Left-Kidny", {"spleen", "left kidney"}), "; did you mean 'left kidney'?");
}

TEST(NearestName, IsSilentAboutWhatIsFar) {
  EXPECT_EQ(suggestion("transparency", {"faces", "size"}), "");
  EXPECT_EQ(suggestion("x", {}), "");
  EXPECT_EQ(suggestion("ab", {"cd"}), "") << "two changes make any two letters equal";
}

}  // namespace
}  // namespace organbake
