// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

namespace organbake {

// What a program of this project ends with. The manual lists them (apps/manual/troubleshooting.md).
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

// The base of all errors that a user can mend. what() is a sentence that names the file, the value
// and what to do. Whatever else is thrown is a defect of the program.
class Error : public std::runtime_error {
 public:
  Error(ExitCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
  ExitCode code() const { return code_; }

 private:
  ExitCode code_;
};

// A flag, an argument or an option's value that cannot be used.
class UsageError : public Error {
 public:
  explicit UsageError(const std::string& message) : Error(ExitCode::usage, message) {}
};

// A file, or data handed to a library call, whose content is wrong.
class BadDataError : public Error {
 public:
  explicit BadDataError(const std::string& message) : Error(ExitCode::bad_data, message) {}
  BadDataError(const std::filesystem::path& file, const std::string& message)
      : Error(ExitCode::bad_data, file.string() + ": " + message) {}
};

// An input that does not exist or cannot be opened.
class NoInputError : public Error {
 public:
  NoInputError(const std::filesystem::path& file, const std::string& message)
      : Error(ExitCode::no_input, file.string() + ": " + message) {}
};

// The system failed: while reading (exit code 74), or while writing (73), as when a disk is full.
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

// A recipe's key or value that is wrong.
class RecipeError : public Error {
 public:
  explicit RecipeError(const std::string& message) : Error(ExitCode::bad_recipe, message) {}
};

// Whoever runs the computation asked it to stop (RunContext).
class CancelledError : public Error {
 public:
  CancelledError() : Error(ExitCode::interrupted, "interrupted") {}
};

// For the checks of options: throws UsageError "name = value: advice" unless `holds`.
void require(bool holds, const std::string& name, double value, const char* advice);

// The one place where an exception becomes an exit code. Unknown exceptions are defects (70);
// std::bad_alloc asks to try again with more memory (75).
ExitCode exit_code_for(const std::exception& error);

// What to tell a user of it, in one line: what() of our own errors; of the system's and the
// standard library's, whose what() is for programmers, words of our own.
std::string message_for(const std::exception& error);

}  // namespace organbake
