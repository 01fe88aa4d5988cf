// SPDX-License-Identifier: Apache-2.0
#include "organbake/core/error.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <new>

#include "organbake/core/run_context.h"

namespace organbake {
namespace {

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

}  // namespace
}  // namespace organbake
