"""Convergence of draws: the daemon's R̂ and effective sample sizes, against ArviZ on the samples."""

import dataclasses
import math

import pytest

import polyest
from polyest import datatree

SAMPLES = 1000


@pytest.fixture(scope="module")
def oscillator():
    """A problem with four unknown parameters, by the standard deviation of the noise, m."""
    def problem(noise):
        return (polyest.Problem.builtin("mass_spring_damper")
                .uncertain("k", polyest.Uniform(31.584, 47.376))
                .uncertain("c", polyest.Uniform(0.1, 0.3)).uncertain("m", polyest.Uniform(0.9, 1.1))
                .uncertain("x0", polyest.Uniform(0.9, 1.1)).measure("x", noise=noise))
    return problem


@pytest.fixture(scope="module")
def first(record):
    """The first 2 s of the record."""
    return {name: values[:40] for name, values in record.items()}


@pytest.fixture(scope="module")
def chains(client, oscillator, first):
    """An experiment whose posterior fills the prior's box: its draws come from Markov chains."""
    return client.experiment(oscillator(1.0), first)


@pytest.fixture(scope="module")
def posterior(chains):
    return chains.posterior(samples=SAMPLES)


def test_chains_that_have_mixed_say_so(posterior):
    assert posterior.method == "MARKOV_CHAINS"
    found = posterior.convergence()
    assert list(found.parameters) == list(posterior.parameters)
    assert found.converged and found.draw_count == posterior.draw_count
    for name, one in found.parameters.items():
        assert one.r_hat == posterior[name].r_hat
        # √((N − 1)/N) is its least value, N the draws of a half of a group.
        assert 0.999 < one.r_hat <= 1.01
        assert 400 <= one.effective_sample_size <= posterior.draw_count


def test_the_effective_size_is_that_of_the_samples_scatter(posterior):
    for column, name in enumerate(posterior.parameters):
        drawn = posterior.samples[:, column]
        effective = posterior.convergence()[name].effective_sample_size
        # Two means of the same quantity: one of all draws, one of the samples.
        error = posterior[name].std_dev * math.sqrt(1 / SAMPLES + 1 / effective)
        assert abs(drawn.mean() - posterior[name].mean) < 4 * error


def test_arviz_finds_the_samples_as_good_as_independent(chains):
    pytest.importorskip("xarray", reason="xarray is missing: pip install xarray")
    arviz = pytest.importorskip("arviz", reason="ArviZ is missing: pip install arviz")
    group = datatree.groups(chains, samples=SAMPLES)["posterior"]
    for name in group.data_vars:
        # A hundredth of the draws. ArviZ's estimate of a size scatters by a tenth of it.
        assert float(arviz.ess(group[name].values)) > 0.7 * SAMPLES
        # R̂² of eight sequences of 125 independent draws is 1 + (χ²/7 − 1)/125 with χ² of 7 degrees
        # of freedom, which is below 24.3 with the probability 0.999.
        assert group[name].sizes == {"chain": 4, "draw": SAMPLES // 4}
        assert 0.995 < float(arviz.rhat(group[name].values)) < 1.01
        assert group[name].attrs["r_hat"] <= 1.01


def test_samples_are_of_all_chains_alike(chains):
    posterior = chains.posterior(samples=1002)
    assert posterior.sample_chains.tolist() == [0] * 251 + [1] * 251 + [2] * 250 + [3] * 250
    # As many of each as the shortest has.
    draws = datatree._by_chain(posterior.samples[:, 0], posterior.sample_chains)
    assert draws.shape == (4, 250)
    assert draws[2].tolist() == posterior.samples[502:752, 0].tolist()


def test_importance_sampling_has_no_r_hat(client, problem, record):
    posterior = client.experiment(problem, record).posterior()
    assert posterior.method == "IMPORTANCE_SAMPLING" and len(posterior.sample_chains) == 0
    found = posterior.convergence()
    assert found.converged
    for one in found.parameters.values():
        assert math.isnan(one.r_hat) and one.effective_sample_size >= 400
        assert math.isnan(posterior[one.name].r_hat)
    assert math.isnan(posterior.r_hat)
    assert "has no chains and no R̂" in repr(found)
    assert repr(found).splitlines()[2].split() == [
        "k", "–", f"{found['k'].effective_sample_size:.0f}", "suffices"]


@pytest.mark.parametrize(("r_hat", "effective", "converged"), [
    (1.009, 400.0, True), (1.011, 400.0, False), (1.009, 399.0, False), (1.3, 50.0, False)])
def test_chains_that_have_not_mixed_are_named(posterior, r_hat, effective, converged):
    stuck = dataclasses.replace(posterior["k"], r_hat=r_hat, effective_sample_size=effective)
    found = dataclasses.replace(
        posterior, parameters={**posterior.parameters, "k": stuck}).convergence()
    assert found["k"].converged is converged and found.converged is converged
    assert found["c"].converged
    assert ("does not suffice" in found._repr_html_()) is not converged
    assert f"{r_hat:.4f}" in repr(found)


def test_a_table_has_a_row_for_each_parameter(posterior):
    pytest.importorskip("pandas")
    frame = posterior.convergence().to_dataframe()
    assert list(frame.index) == ["k", "c", "m", "x0"]
    assert list(frame.columns) == ["r_hat", "effective_sample_size", "converged"]
    assert frame.converged.all()
