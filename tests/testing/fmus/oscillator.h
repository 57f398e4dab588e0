/* An oscillator m x'' + c x' + k x = force, like the built-in mass_spring_damper. */
enum { kM, kC, kK, kX0, kV0, kForce, kX, kV, kA, kXRate, REALS };
#define STATES 2
#define INDICATORS 0

static const double kStart[REALS] = {[kM] = 0.1, [kK] = 3.9478417604357434};
static const int kStates[STATES] = {kX, kV};
static const int kDerivatives[STATES] = {kXRate, kA};

static int Initialize(Fmu* fmu) {
  fmu->real[kX] = fmu->real[kX0];
  fmu->real[kV] = fmu->real[kV0];
  return kOk;
}

static int Evaluate(Fmu* fmu) {
  double* r = fmu->real;
  r[kXRate] = r[kV];
  /* a = (force - c v - k x)/m */
  r[kA] = (r[kForce] - r[kC] * r[kV] - r[kK] * r[kX]) / r[kM];
  if (r[kM] > 0) return kOk;
  Log(fmu, kError, "the mass must be above 0");
  return kError;
}

static void Indicate(const Fmu* fmu, double* z) { (void)fmu, (void)z; }

static int HandleEvent(Fmu* fmu) {
  (void)fmu;
  return kOk;
}
