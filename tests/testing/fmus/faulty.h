/* x = x0 + rate t, with a fault from a given time on: an error, a discarded step, NaN, a crash, a
   hang, a memory leak or an exit. */
#include <signal.h>
#include <unistd.h>

enum {
  kX0,
  kRate,
  kErrorAt,
  kDiscardAt,
  kNanAt,
  kCrashAt,
  kHangAt,
  kLeakAt,
  kExitAt,
  kX,
  kXRate,
  REALS
};
#define STATES 1
#define INDICATORS 0
#define NEVER 1e300

static const double kStart[REALS] = {
    [kRate] = 1,        [kErrorAt] = NEVER, [kDiscardAt] = NEVER, [kNanAt] = NEVER,
    [kCrashAt] = NEVER, [kHangAt] = NEVER,  [kLeakAt] = NEVER,    [kExitAt] = NEVER};
static const int kStates[STATES] = {kX};
static const int kDerivatives[STATES] = {kXRate};

static int Initialize(Fmu* fmu) {
  fmu->real[kX] = fmu->real[kX0];
  return kOk;
}

static int Evaluate(Fmu* fmu) {
  double* r = fmu->real;
  const double t = fmu->time_s;
  r[kXRate] = r[kRate];
  if (t >= r[kNanAt]) r[kXRate] = NAN;
  if (t >= r[kErrorAt]) {
    Log(fmu, kError, "the test wants it");
    return kError;
  }
  if (t >= r[kDiscardAt]) return kDiscard;
  if (t >= r[kCrashAt]) {
    Log(fmu, kWarning, "about to crash");
    raise(SIGSEGV);
  }
  if (t >= r[kExitAt]) _exit(7);
  while (t >= r[kHangAt]) sleep(1000);
  while (t >= r[kLeakAt]) {
    const size_t size = (size_t)4 << 20;
    memset(malloc(size), 1, size); /* crashes when there is no more memory */
  }
  return kOk;
}

static void Indicate(const Fmu* fmu, double* z) { (void)fmu, (void)z; }

static int HandleEvent(Fmu* fmu) {
  (void)fmu;
  return kOk;
}
