/* x' = rate, where the rate changes its sign at each multiple of the period: a time event. */
enum { kRate, kPeriod, kX0, kX, kXRate, kSign, REALS };
#define STATES 1
#define INDICATORS 0

static const double kStart[REALS] = {[kRate] = 1, [kPeriod] = 0.3, [kSign] = -1};
static const int kStates[STATES] = {kX};
static const int kDerivatives[STATES] = {kXRate};

static int Initialize(Fmu* fmu) {
  fmu->real[kX] = fmu->real[kX0];
  fmu->next_event_s = 0;
  return kOk;
}

static int Evaluate(Fmu* fmu) {
  fmu->real[kXRate] = fmu->real[kSign] * fmu->real[kRate];
  return kOk;
}

static void Indicate(const Fmu* fmu, double* z) { (void)fmu, (void)z; }

static int HandleEvent(Fmu* fmu) {
  if (fmu->time_s < fmu->next_event_s) return kOk;
  fmu->real[kSign] = -fmu->real[kSign];
  fmu->next_event_s += fmu->real[kPeriod];
  return kOk;
}
