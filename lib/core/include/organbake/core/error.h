// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

namespace organbake {

// What a program of this project ends with; the README's table is made of these.
enum class ExitCode : int {
  ok = 0,
  usage = 2,          // unknown flag, missing argument, value out of range
  quality_gate = 3,   // everything ran, but a requested quality was not reached
  batch_partial = 4,  // part of a batch failed
  bad_data = 65,      // a file's content is wrong
  no_input = 66,      // an input file or folder does not exist or cannot be opened
  internal = 70,      // a defect of this program
  cannot_write = 73,  // output cannot be created or the disk is full
  read_error = 74,    // the system failed while reading
  try_again = 75,     // a passing fault
  bad_recipe = 78,    // a recipe's key or value is wrong
  interrupted = 130,  // Ctrl-C
};

// Base of all errors that a user can mend. what() names the file, the value and what to do.
class Error : public std::runtime_error {
 public:
  Error(ExitCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
  ExitCode code() const { return code_; }

 private:
  ExitCode code_;
};

class UsageError : public Error {
 public:
  explicit UsageError(const std::string& message) : Error(ExitCode::usage, message) {}
};

class BadDataError : public Error {
 public:
  explicit BadDataError(const std::string& message) : Error(ExitCode::bad_data, message) {}
  BadDataError(const std::filesystem::path& file, const std::string& message)
      : Error(ExitCode::bad_data, file.string() + ": " + message) {}
};

class NoInputError : public Error {
 public:
  NoInputError(const std::filesystem::path& file, const std::string& message)
      : Error(ExitCode::no_input, file.string() + ": " + message) {}
};

// Covers both ways in which a system can fail us: reading (74) and writing (73).
class IoError : public Error {
 public:
  static IoError reading(const std::filesystem::path& file, const std::string& message) {
    return {ExitCode::read_error, file, message};
  }
  static IoError writing(const std::filesystem::path& file, const std::string& message) {
    return {ExitCode::cannot_write, file, message};
  }

 private:
  IoError(ExitCode code, const std::filesystem::path& file, const std::string& message)
      : Error(code, file.string() + ": " + message) {}
};

class RecipeError : public Error {
 public:
  explicit RecipeError(const std::string& message) : Error(ExitCode::bad_recipe, message) {}
};

class CancelledError : public Error {
 public:
  CancelledError() : Error(ExitCode::interrupted, "interrupted") {}
};

// For options: throws UsageError "name = value: advice" unless it holds.
void require(bool holds, const std::string& name, double value, const char* advice);

// The one place where an exception becomes an exit code. Unknown exceptions are defects (70);
// std::bad_alloc asks to try again with more memory (75).
ExitCode exit_code_for(const std::exception& error);

// What to say of it, one line; for what() of the system's own exceptions is none for users.
std::string message_for(const std::exception& error);

}  // namespace organbake
