/* A ball above a floor, h'' = -g. At the floor its velocity is reversed and multiplied by e. If the
   velocity is then below rest_speed, the ball stays on the floor. */
enum { kG, kE, kRestSpeed, kH0, kH, kV, kA, kHRate, kResting, REALS };
#define STATES 2
#define INDICATORS 1

static const double kStart[REALS] = {[kG] = 9.81, [kE] = 0.7, [kRestSpeed] = 0.01, [kH0] = 1};
static const int kStates[STATES] = {kH, kV};
static const int kDerivatives[STATES] = {kHRate, kA};

static int Initialize(Fmu* fmu) {
  fmu->real[kH] = fmu->real[kH0];
  return kOk;
}

static int Evaluate(Fmu* fmu) {
  double* r = fmu->real;
  r[kHRate] = r[kResting] ? 0 : r[kV];
  r[kA] = r[kResting] ? 0 : -r[kG];
  return kOk;
}

static void Indicate(const Fmu* fmu, double* z) { z[0] = fmu->real[kResting] ? 1 : fmu->real[kH]; }

static int HandleEvent(Fmu* fmu) {
  double* r = fmu->real;
  if (r[kResting] || r[kH] > 0 || r[kV] >= 0) return kOk;
  r[kH] = 0;
  r[kV] = -r[kE] * r[kV];
  if (r[kV] < r[kRestSpeed]) {
    r[kV] = 0;
    r[kResting] = 1;
  }
  return kOk;
}
