"""Groups for ArviZ, and draws of priors against their moments."""

import numpy as np
import pytest

import polyest
from conftest import EXAMPLES
from polyest import datatree
from polyest._draws import draws_of, prior_draws

xarray = pytest.importorskip("xarray")

DRAWS = 20_000


@pytest.fixture(scope="module")
def experiment(client, record):
    """The oscillator with its record."""
    wanted = (polyest.Problem.builtin("mass_spring_damper").fix(m=1.0, x0=1.0)
              .uncertain("k", polyest.Uniform(31.584, 47.376))
              .uncertain("c", polyest.Uniform(0.1, 0.3)).measure("x", noise=0.01))
    return client.experiment(wanted, record)


def test_groups_have_draws_data_and_predictions(experiment, record):
    groups = datatree.groups(experiment, samples=500)
    assert dict(groups["posterior"].sizes) == {"chain": 1, "draw": 500}
    assert groups["posterior"]["k"].attrs["units"] == "N/m"
    assert dict(groups["prior"].sizes) == {"chain": 1, "draw": 500}
    np.testing.assert_allclose(groups["observed_data"]["x"], record["x"])
    np.testing.assert_array_equal(groups["observed_data"]["time"], record["t"])
    assert groups["prediction"]["x_quantiles"].dims == ("row", "probability")
    estimate = experiment.estimate()
    # The mean of 500 draws scatters by 0.045 standard deviations.
    assert abs(float(groups["posterior"]["k"].mean()) - estimate["k"].mean) < (
        0.2 * estimate["k"].std_dev)


def test_draws_have_the_likelihood_of_the_exact_solution(experiment, record):
    groups = datatree.groups(experiment, samples=20, predictive=True)
    k, c = (groups["posterior"][name].values[0][:, np.newaxis] for name in ("k", "c"))
    t, frequency = record["t"], np.sqrt(k - c**2 / 4)
    exact = np.exp(-c * t / 2) * (np.cos(frequency * t) + c / 2 / frequency * np.sin(frequency * t))
    expected = -0.5 * ((record["x"] - exact) / 0.01) ** 2 - np.log(0.01 * np.sqrt(2 * np.pi))
    found = groups["log_likelihood"]["x"]
    assert found.dims == ("chain", "draw", "row")
    # An error e of the trajectory changes the log density by up to 4 e/σ, σ = 0.01; e is 10⁻⁶.
    np.testing.assert_allclose(found.values[0], expected, atol=4e-4)
    new = groups["posterior_predictive"]["x"].values[0]
    # The standard deviation of 20,000 draws scatters by 0.5 %.
    assert abs((new - exact).std() / 0.01 - 1) < 4 * 0.005


def test_the_likelihood_is_that_of_every_row(client, problem):
    times = np.arange(1, 2501) * 0.01
    # The exact solution of the oscillator, c²/4 ≪ k.
    x = np.exp(-0.115 * times) * np.cos(np.sqrt(41.3 - 0.115**2) * times)
    experiment = client.experiment(problem, {"t": times, "x": x})
    groups = datatree.groups(experiment, samples=2, predictive=True)
    assert groups["log_likelihood"]["x"].sizes["row"] == 2500
    assert groups["observed_data"]["x"].sizes["row"] == 2500
    with pytest.warns(UserWarning, match="have 2000 of 2500 rows"):
        datatree.groups(experiment, samples=2)


def test_the_prior_has_the_parameters_of_the_posterior(client):
    problem = polyest.Problem.read(EXAMPLES / "releases.json")
    data = np.genfromtxt(EXAMPLES / "releases.csv", delimiter=",", names=True)
    groups = datatree.groups(client.experiment(problem, data), samples=20)
    assert list(groups["prior"].data_vars) == list(groups["posterior"].data_vars)
    first, second = groups["prior"]["x0[0]"], groups["prior"]["x0[1]"]
    assert float(abs(first - second).max()) > 0  # each run has its own


@pytest.mark.parametrize(("prior", "middle", "unit"), [
    (polyest.Normal(40, 4), "k.mean", 4.0), (polyest.Uniform(30, 50), "k.median", 1.0),
    (polyest.Lognormal(40, 4), "k.median", np.sqrt(np.log1p(0.01)))],
    ids=["normal", "uniform", "lognormal"])
def test_draws_of_a_population_are_those_of_its_prior(prior, middle, unit):
    problem = (polyest.Problem.builtin("mass_spring_damper")
               .uncertain("k", prior, per_run=True, population=True)
               .uncertain("c", polyest.Uniform(0, 1), drift=(0.01, 1.0))
               .process_noise("v", (1e-4, 1.0)))
    names = [middle, "k.spread", "k[3]", "c", "c.drift", "processNoise.v"]
    drawn = draws_of(names, problem.as_dict(), DRAWS, 1)
    assert list(drawn) == names
    # Medians of the contract; that of n draws scatters by √(π/2n) standard deviations.
    error = 4 * np.sqrt(np.pi / 2 / DRAWS)
    assert abs(np.median(np.log(drawn["k.spread"] / (unit / 2)))) < error
    assert abs(np.std(np.log(drawn["k.spread"])) - 1) < 4 / np.sqrt(2 * DRAWS)
    # 40, ln 40 less half the variance of the logarithm, and 20/√12 or 4 of them.
    centre = 40 / np.sqrt(1.01) if "lognormal" in prior.as_json() else 40
    assert abs(np.median(drawn[middle]) - centre) < error * 7
    assert abs(np.median(drawn["k[3]"]) - centre) < error * 10
    # Runs scatter about the middle by the spread.
    assert np.std(drawn["k[3]"] - drawn[middle]) > 1
    for name, lower, upper in (("c.drift", 0.01, 1.0), ("processNoise.v", 1e-4, 1.0)):
        logarithm = np.log(drawn[name] / lower) / np.log(upper / lower)
        assert logarithm.min() >= 0 and logarithm.max() <= 1
        assert abs(logarithm.mean() - 0.5) < 4 / np.sqrt(12 * DRAWS)


def test_draws_far_out_in_a_tail_are_within_the_bounds():
    problem = polyest.Problem.builtin("mass_spring_damper").uncertain(
        "k", polyest.TruncatedNormal(0, 1, lower=9))
    drawn = prior_draws(problem.as_dict(), DRAWS, 1)["k"]
    # Mills' ratio: the mean is 9 + 1/9 − 2/9³ to 0.1 %, and the standard deviation is 0.11.
    assert drawn.min() >= 9 and len(set(drawn)) > DRAWS / 2
    assert abs(drawn.mean() - (9 + 1 / 9 - 2 / 9**3)) < 0.001 + 4 * 0.11 / np.sqrt(DRAWS)


def test_samples_that_are_not_independent_have_no_likelihood_here(client, record):
    wanted = (polyest.Problem.builtin("mass_spring_damper").fix(m=1.0, x0=1.0)
              .uncertain("k", polyest.Uniform(31.584, 47.376))
              .measure("x", polyest.Noise(unknown=True)))
    with pytest.raises(polyest.InvalidInput, match="predictive: is not there for problems with "
                       "noise that is unknown"):
        datatree.groups(client.experiment(wanted, record), samples=10, predictive=True)


@pytest.mark.skipif(not hasattr(xarray, "DataTree"), reason="xarray is older than 2024.10")
def test_arviz_reads_the_tree(experiment):
    arviz = pytest.importorskip("arviz")
    tree = experiment.estimate().to_datatree(samples=500)
    assert set(tree.children) == {"posterior", "prior", "observed_data", "prediction"}
    # ArviZ 1 reads trees, earlier ones their groups.
    newer = int(arviz.__version__.split(".")[0]) >= 1
    summary = arviz.summary(tree if newer else tree["posterior"].to_dataset())
    assert set(summary.index) == {"k", "c"}


@pytest.mark.skipif(hasattr(xarray, "DataTree"), reason="xarray has DataTree")
def test_an_old_xarray_is_told(experiment):
    with pytest.raises(ImportError, match=r"xarray 2024.10 or later; polyest.datatree.groups"):
        experiment.estimate().to_datatree()


@pytest.mark.parametrize(("prior", "mean", "std_dev"), [
    (polyest.Uniform(1, 3), 2, 2 / np.sqrt(12)),
    (polyest.Normal(5, 2), 5, 2),
    (polyest.Beta(2, 3, 10, 20), 10 + 10 * 2 / 5, 10 * np.sqrt(6 / (25 * 6))),
    (polyest.Gamma(4, 0.5, 1), 3, 1),
    (polyest.Lognormal(40, 5), 40, 5),
    (polyest.TruncatedNormal(0, 1, lower=0), np.sqrt(2 / np.pi), np.sqrt(1 - 2 / np.pi)),
], ids=lambda value: type(value).__name__)
def test_draws_have_the_moments_of_their_prior(client, prior, mean, std_dev):
    problem = polyest.Problem.builtin("mass_spring_damper").uncertain("k", prior)
    drawn = prior_draws(problem.as_dict(), DRAWS, 1)["k"]
    error = std_dev / np.sqrt(DRAWS)
    assert abs(drawn.mean() - mean) < 4 * error
    # The kurtosis of none of them is above 10.
    assert abs(drawn.std() - std_dev) < 4 * 1.5 * error


def test_correlated_draws_have_the_copulas_ranks():
    problem = (polyest.Problem.builtin("mass_spring_damper").uncertain("k", polyest.Normal(0, 1))
               .uncertain("c", polyest.Normal(0, 1)).correlate("k", "c", 0.8))
    drawn = prior_draws(problem.as_dict(), DRAWS, 1)
    found = np.corrcoef(drawn["k"], drawn["c"])[0, 1]
    assert abs(found - 0.8) < 4 * (1 - 0.8**2) / np.sqrt(DRAWS)
