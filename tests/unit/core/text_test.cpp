// SPDX-License-Identifier: Apache-2.0
#include "organbake/core/text.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>

namespace organbake {
namespace {

TEST(ToText, ReadsBackAsTheSameDouble) {
  for (const double value : {0.1, 1.0 / 3, 6.02e23, -5e-324, 1.7976931348623157e308, 0.0}) {
    EXPECT_EQ(std::strtod(to_text(value).c_str(), nullptr), value);
  }
  EXPECT_EQ(to_text(0.1), "0.1");
}

TEST(ToText, RoundsToTheDigitsAskedFor) {
  EXPECT_EQ(to_text(12.346, 2), "12.35");
  EXPECT_EQ(to_text(-1e300, 0).size(), 302u);  // the longest there is
}

TEST(Padded, FillsUpWithZerosAndCutsNothing) {
  EXPECT_EQ(padded(7, 3), "007");
  EXPECT_EQ(padded(0, 1), "0");
  EXPECT_EQ(padded(12345, 3), "12345");
}

TEST(Trimmed, LosesTheBlanksAtBothEndsOnly) {
  EXPECT_EQ(trimmed("\t a b \r\n"), "a b");
  EXPECT_EQ(trimmed(" \n"), "");
  EXPECT_EQ(trimmed("\ta ", " "), "\ta");
}

TEST(FirstLetter, SkipsBlanksAndIsZeroWhereNothingElseStands) {
  EXPECT_EQ(first_letter(" \n{"), '{');
  EXPECT_EQ(first_letter(" \t"), '\0');
}

TEST(EscapeHtml, LeavesNothingThatMarkupWouldRead) {
  EXPECT_EQ(escape_html("a<b & 'c' > \"d\""), "a&lt;b &amp; &#39;c&#39; &gt; &quot;d&quot;");
}

}  // namespace
}  // namespace organbake
