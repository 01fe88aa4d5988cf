// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/html_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <set>

#include "organbake/image/png.h"

namespace organbake {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

TEST(HtmlPage, EscapesWhatIsText) {
  EXPECT_THAT(html_page("a<b", "", ""), HasSubstr("<title>a&lt;b</title>"));
  EXPECT_EQ(html_cell("<script>"), "<td>&lt;script&gt;</td>");
  EXPECT_THAT(html_picture(Rgb8Image(1, 1), "a \"b\""), HasSubstr("alt=\"a &quot;b&quot;\""));
}

// RFC 4648 digits of a PNG, read back by hand; widths give file sizes of every remainder by 3.
std::string from_base64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned buffer = 0;
  int bits = 0;
  for (const char c : text) {
    if (c == '=') break;
    buffer = buffer << 6 | static_cast<unsigned>(digits.find(c));
    if ((bits += 6) >= 8) bytes += static_cast<char>(buffer >> (bits -= 8) & 255);
  }
  return bytes;
}

TEST(HtmlPage, PicturesAreWholeInTheirLink) {
  std::set<std::size_t> remainders;
  for (int width = 1; width < 40; ++width) {
    Rgb8Image image(width, 3);
    for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = (i * 37 + 11) % 256;
    const std::string uri = png_data_uri(image), start = "data:image/png;base64,";
    ASSERT_THAT(uri, StartsWith(start));
    EXPECT_EQ((uri.size() - start.size()) % 4, 0u);
    EXPECT_EQ(from_base64(uri.substr(start.size())), encode_png(image));
    remainders.insert(encode_png(image).size() % 3);
  }
  EXPECT_EQ(remainders.size(), 3u) << "a remainder was not tried";
}

TEST(PageNumber, HasFourDigitsThatCount) {
  EXPECT_EQ(page_number(0), "0");
  EXPECT_EQ(page_number(0.012345678), "0.01235");
  EXPECT_EQ(page_number(-2.5), "-2.5");
  EXPECT_EQ(page_number(1234.56), "1235");
  EXPECT_EQ(page_number(12e6), "12000000");
  EXPECT_EQ(page_number(std::numeric_limits<double>::infinity()), "inf");
}

}  // namespace
}  // namespace organbake
