// SPDX-License-Identifier: GPL-3.0-or-later
#include <signal.h>
#include <sys/time.h>
#include <unistd.h>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "probes.h"
#include "promises.h"
#include "support/testing.h"

// Seeded, adversarial inputs to every stage: each ends right or is refused with words that a user
// can act on; none is wrong, not finite, crashes or hangs. Case N of a stage is drawn from the seed
// N: ORGANBAKE_FIRST_CASE and ORGANBAKE_CASES choose others than the first ones, one alone for a
// debugger.
namespace organbake {
namespace {

// Of one case, in CPU time; longer ones hang. Sanitizers make 40 s of the slowest one's two.
#ifdef __SANITIZE_ADDRESS__
constexpr time_t kMostSeconds = 300;
#else
constexpr time_t kMostSeconds = 60;
#endif

std::vector<Probe> all_probes() {
  std::vector<Probe> all;
  for (const auto& probes : {surface_probes(), bundle_probes(), photo_probes()})
    all.insert(all.end(), probes.begin(), probes.end());
  return all;
}

// What a case that ends the process says with its last breath.
char last_words[200] = "";
void say_last_words(int signal) {
  [[maybe_unused]] const ssize_t written = ::write(2, last_words, std::strlen(last_words));
  ::signal(signal, SIG_DFL);
  ::raise(signal);
}

// From here to the end of the scope a crash or a hang names its case.
class Watch {
 public:
  Watch(const Probe& probe, std::uint64_t seed) {
    std::snprintf(last_words, sizeof last_words,
                  "%s, case %llu, crashed or took more than %lld s\n", probe.name,
                  static_cast<unsigned long long>(seed), static_cast<long long>(kMostSeconds));
    for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGPROF})
      ::signal(signal, say_last_words);
    set_timer(kMostSeconds);
  }
  ~Watch() {
    set_timer(0);
    for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGPROF})
      ::signal(signal, SIG_DFL);
  }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

 private:
  static void set_timer(time_t seconds) {
    const itimerval timer = {{0, 0}, {seconds, 0}};
    ::setitimer(ITIMER_PROF, &timer, nullptr);
  }
};

// What became of one case: nothing when it was right or refused.
struct Ending {
  bool refused = false;
  double error = 0;  // share of what is allowed
  std::string fault;
};

Ending end_of(const Probe& probe, std::uint64_t seed) {
  const Watch watch(probe, seed);
  RandomStream random(seed);
  Ending ending;
  try {
    ending.error = probe.run(random);
    if (!std::isfinite(ending.error)) return {false, 0, "the error itself is not finite"};
    if (ending.error > 1) ending.fault = to_text(ending.error, 3) + " × " + probe.allowed;
  } catch (const NotFinite& error) {
    ending.fault = std::string("not finite: ") + error.what();
  } catch (const Error& error) {
    ending.refused = error.code() != ExitCode::internal && *error.what() != '\0';
    if (!ending.refused) ending.fault = error.what();
  } catch (const std::exception& error) {
    ending.fault = std::string("no error for users: ") + error.what();
  }
  return ending;
}

struct SeededInputs : testing::TestWithParam<Probe> {};

TEST_P(SeededInputs, EndRightOrRefused) {
  const Probe& probe = GetParam();
  const ThreadLimit one_thread(1);
  const auto [first, count] = asked_seeds(360, 720);
  double refused = 0, worst = 0, failures = 0;
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    const Ending ending = end_of(probe, seed);
    refused += ending.refused;
    worst = std::max(worst, ending.error);
    failures += !ending.fault.empty();
    EXPECT_EQ(ending.fault, "") << probe.name << ", case " << seed;
  }
  report("refused of " + std::to_string(count), "", refused);
  expect({"worst error of what is allowed", "×", worst, 1});
  expect({"wrong or not finite", "", failures, 0});
}

TEST_P(SeededInputs, AreTheSameAgain) {
  const Ending once = end_of(GetParam(), 1), again = end_of(GetParam(), 1);
  EXPECT_EQ(once.error, again.error);
  EXPECT_EQ(once.refused, again.refused);
  EXPECT_EQ(once.fault, again.fault);
}

INSTANTIATE_TEST_SUITE_P(Stage, SeededInputs, testing::ValuesIn(all_probes()),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace

void expect_finite(double value, const char* what) {
  if (!std::isfinite(value)) throw NotFinite(what);
}

void expect_finite(const TriangleMesh& mesh, const char* what) {
  for (const Eigen::Vector3d& vertex : mesh.vertices)
    if (!vertex.allFinite()) throw NotFinite(what);
}

}  // namespace organbake
