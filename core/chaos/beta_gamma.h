#pragma once

// Cumulative probabilities of the beta and gamma densities in their standard forms, and their
// quantiles in the nearer tail. Arguments outside of the stated ranges are a programmer's error.

namespace polyest::internal {

double LogGamma(double x);                  // log Γ(x), x > 0
double LogBeta(double alpha, double beta);  // log B(α, β)
double TimesLog(double factor, double x);   // factor · log(x); 0 for factor = 0 even at x = 0

double IncompleteBeta(double alpha, double beta, double u);  // I_u(α, β), clamped to u in [0, 1]
// The regularized incomplete gamma functions P and Q; x < 0 counts as 0.
double LowerIncompleteGamma(double shape, double x);
double UpperIncompleteGamma(double shape, double x);

// α, β, shape ≥ 1 and 0 < p ≤ ½:
double LowerBetaQuantile(double alpha, double beta, double p);  // u with I_u(α, β) = p
double LowerGammaQuantile(double shape, double p);              // x with P(shape, x) = p
double UpperGammaQuantile(double shape, double q);              // x with Q(shape, x) = q

}  // namespace polyest::internal
