// SPDX-License-Identifier: Apache-2.0
#include "organbake/core/text.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <new>
#include <string_view>
#include <utility>

#include "organbake/core/error.h"
#include "organbake/core/run_context.h"
#include "organbake/core/scalar_type.h"
#include "organbake/core/sha256.h"

namespace organbake {
namespace {

TEST(ToText, ReadsBackAsTheSameDouble) {
  for (const double value : {0.1, 1.0 / 3, 6.02e23, -5e-324, 1.7976931348623157e308, 0.0})
    EXPECT_EQ(std::strtod(to_text(value).c_str(), nullptr), value);
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

TEST(NearestName, SuggestsWhatIsClose) {
  const std::vector<std::string> names = {"faces", "method", "size"};
  EXPECT_EQ(suggestion("facs", names), "; did you mean 'faces'?");
  EXPECT_EQ(suggestion("metod", names), "; did you mean 'method'?");
  EXPECT_EQ(suggestion("siez", names), "; did you mean 'size'?");
  EXPECT_EQ(suggestion("Left-Kidny", {"spleen", "left kidney"}), "; did you mean 'left kidney'?");
}

TEST(NearestName, SuggestsTheNameWithItsUnit) {
  EXPECT_EQ(suggestion("field_of_view", {"faces", "field_of_view_deg"}),
            "; did you mean 'field_of_view_deg'?");
  EXPECT_EQ(suggestion("--stereo", {"--stereo-mm"}), "; did you mean '--stereo-mm'?");
  EXPECT_EQ(suggestion("view", {"viewing_cone"}), "") << "another word goes on there";
}

TEST(NearestName, IsSilentAboutWhatIsFar) {
  EXPECT_EQ(suggestion("transparency", {"faces", "size"}), "");
  EXPECT_EQ(suggestion("x", {}), "");
  EXPECT_EQ(suggestion("ab", {"cd"}), "") << "two changes make any two letters equal";
}

TEST(ExitCodeFor, NamesEveryKindOfError) {
  EXPECT_EQ(exit_code_for(UsageError("x")), ExitCode::usage);
  EXPECT_EQ(exit_code_for(BadDataError("x")), ExitCode::bad_data);
  EXPECT_EQ(exit_code_for(NoInputError("f", "x")), ExitCode::no_input);
  EXPECT_EQ(exit_code_for(IoError::reading("f", "x")), ExitCode::read_error);
  EXPECT_EQ(exit_code_for(IoError::writing("f", "x")), ExitCode::cannot_write);
  EXPECT_EQ(exit_code_for(RecipeError("x")), ExitCode::bad_recipe);
  EXPECT_EQ(exit_code_for(CancelledError()), ExitCode::interrupted);
  EXPECT_EQ(exit_code_for(std::bad_alloc()), ExitCode::try_again);
  const std::filesystem::filesystem_error refused("x", std::error_code());
  EXPECT_EQ(exit_code_for(refused), ExitCode::read_error);
  EXPECT_EQ(exit_code_for(std::runtime_error("x")), ExitCode::internal);
}

TEST(MessageFor, SaysOfTheSystemsErrorsTheFileAndTheReason) {
  const std::filesystem::filesystem_error refused(
      "status", "a/b", std::make_error_code(std::errc::permission_denied));
  EXPECT_EQ(message_for(refused), "a/b: Permission denied");
  EXPECT_EQ(message_for(std::bad_alloc()), "out of memory");
  EXPECT_EQ(message_for(UsageError("x")), "x");
}

TEST(Error, PutsTheFileFirst) {
  EXPECT_STREQ(BadDataError("a/b.ply", "has no faces").what(), "a/b.ply: has no faces");
}

TEST(RunContext, IsSilentByDefaultAndThrowsOnceCancelled) {
  EXPECT_NO_THROW(RunContext().throw_if_cancelled());
  std::atomic<bool> flag{false};
  const RunContext context({}, {}, &flag);
  EXPECT_NO_THROW(context.throw_if_cancelled());
  flag = true;
  EXPECT_THROW(context.throw_if_cancelled(), CancelledError);
}

constexpr std::array kAll = {ScalarType::int8,   ScalarType::uint8,  ScalarType::int16,
                             ScalarType::uint16, ScalarType::int32,  ScalarType::uint32,
                             ScalarType::int64,  ScalarType::uint64, ScalarType::float32,
                             ScalarType::float64};

// Least and largest value tell width, signedness and kind of a C++ type.
TEST(ScalarType, IsDispatchedToTheTypeOfItsName) {
  const std::array<std::pair<double, double>, 8> limits = {{{-128, 127},
                                                            {0, 255},
                                                            {-32768, 32767},
                                                            {0, 65535},
                                                            {-2147483648.0, 2147483647.0},
                                                            {0, 4294967295.0},
                                                            {-0x1p63, 0x1p63},  // rounded
                                                            {0, 0x1p64}}};
  for (std::size_t i = 0; i < limits.size(); ++i) {
    with_scalar_type(kAll[i], [&](auto zero) {
      using Number = decltype(zero);
      EXPECT_EQ(static_cast<double>(std::numeric_limits<Number>::lowest()), limits[i].first);
      EXPECT_EQ(static_cast<double>(std::numeric_limits<Number>::max()), limits[i].second);
    });
    EXPECT_FALSE(is_floating_point(kAll[i]));
    EXPECT_EQ(bytes_of(kAll[i]), std::size_t{1} << i / 2);
  }
  EXPECT_TRUE(is_floating_point(ScalarType::float32));
  EXPECT_TRUE(is_floating_point(ScalarType::float64));
  EXPECT_EQ(bytes_of(ScalarType::float32), 4u);
  EXPECT_EQ(bytes_of(ScalarType::float64), 8u);
}

TEST(ScalarType, SwapsTheBytesOfEachNumber) {
  for (const ScalarType type : kAll) {
    const std::size_t width = bytes_of(type);
    std::array<std::byte, 16> bytes, expected;
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      bytes[i] = static_cast<std::byte>(i);
      expected[i] = static_cast<std::byte>(i / width * width + (width - 1 - i % width));
    }
    swap_bytes(bytes.data(), bytes.size() / width, type);
    EXPECT_EQ(bytes, expected);
  }
}

std::string hash_of(std::string_view text) {
  return sha256_hex(std::as_bytes(std::span(text.data(), text.size())));
}

TEST(Sha256, MatchesTheStandardsExamples) {  // FIPS 180-4
  EXPECT_EQ(hash_of(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(hash_of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

}  // namespace
}  // namespace organbake
