#pragma once

// Tests of a channel's residuals. They grow sharp with the number of samples N, but a deviation
// that would hardly change the uncertainty is not reported, however significant it is. `degrees` is
// the expected χ² of the channel, its degrees of freedom (channel_description.h).

#include "polyest/estimate.h"
#include "polyest/noise.h"

namespace polyest::internal {

// Returns the least χ² per degree of freedom that is too large for the noise assumed. It is 1.2,
// which is noise that is larger by a tenth; 1.5 if outliers are handled, because χ² has those that
// are not taken for gross errors, whose weight is small but not 0; 2 if filters do, whose χ² grows
// with the logarithm of an outlier (bayes/noise.h).
double ExcessRatio(OutlierHandling outliers, bool filtered);
// Returns the least ratio of the degrees of freedom to χ² at which residuals are too small for the
// noise assumed, which is the less dangerous error: 1.5; 2.5 if filters handle outliers, because
// Gaussian noise of the stated size leaves χ² = 0.59 N to 0.69 N there.
double TooSmallRatio(OutlierHandling outliers, bool filtered);
// Returns whether χ² is too large for the noise assumed: for a right model it has the mean ν, the
// degrees of freedom, and a standard deviation of at most √(2N). It must exceed ν by six of them,
// or be as improbable as six standard deviations of a normal variable, and exceed ExcessRatio times
// ν.
bool ExceedsNoise(const ChannelEstimate& channel, double degrees, OutlierHandling outliers,
                  bool filtered);
// Returns whether a channel's outliers may be gross errors, which say nothing of model and noise:
// they are not too many, and χ² of the others is not too large for the noise. For a right model its
// mean is `degrees`, the others' degrees of freedom, and its standard deviation at most 1.1
// √degrees. It must exceed the mean by four of them and by a fifth to contradict. Noise that is
// larger by a fifth reaches that, and of samples that are all far too large those that are no
// outliers exceed it by four fifths. `share` of outliers may be up to a third for Student's t. For
// Huber it may be 0.15: more leave an influence for which a known noise does not account.
bool MayBeGrossErrors(OutlierHandling outliers, double share, double chi_squared_of_others,
                      double degrees);
// Returns the root mean square of the residuals in units of the noise assumed, √(χ²/ν), with at
// least one degree of freedom.
double ResidualToNoise(const ChannelEstimate& channel, double degrees);

// Returns whether successive residuals are correlated: of independent ones the lag-1 correlation
// has the standard deviation 1/√N. It must be four of them and 0.05, which changes the uncertainty
// by a twentieth. `runs` is the number of runs with samples; each contributes 1/2N by chance.
bool AreCorrelated(const ChannelEstimate& channel, int64_t runs);

// Returns whether residuals are correlated over many samples, also where successive ones hardly
// are: the variance ratio of independent ones (record/residual_blocks.h) is χ²/B over B sums. It
// must be as improbable as four standard deviations of a normal variable, and 1.5.
bool AreSlowlyCorrelated(const ChannelEstimate& channel);

// Returns the variance of a mean of residuals relative to that of as many independent ones, at
// least 1: (1 + r)/(1 − r), with r the lag-1 correlation if it is positive, or the variance ratio
// if they are slowly correlated and it is larger.
double VarianceOfMeans(const ChannelEstimate& channel);

// Returns the variance of a mean of residuals relative to that of as many independent samples of
// the noise assumed, at least 1: χ²/ν (if the noise was known) times VarianceOfMeans.
double Dispersion(const ChannelEstimate& channel, double degrees, bool noise_known);

}  // namespace polyest::internal
