"""Studies: shapes, and numbers against closed forms or the estimate."""

import numpy as np
import pytest

import polyest
from conftest import TRUTH


@pytest.fixture(scope="module")
def experiment(client, record):
    """The oscillator with its record."""
    wanted = (polyest.Problem.builtin("mass_spring_damper").fix(m=1.0, x0=1.0)
              .uncertain("k", polyest.Uniform(31.584, 47.376))
              .uncertain("c", polyest.Uniform(0.1, 0.3)).measure("x", noise=0.01))
    return client.experiment(wanted, record)


def motion(k, c, times):
    """The displacement of the free damped oscillator with m = 1, x(0) = 1, v(0) = 0."""
    frequency = np.sqrt(k - c**2 / 4)
    return np.exp(-c * times / 2) * (np.cos(frequency * times)
                                     + c / (2 * frequency) * np.sin(frequency * times))


def test_a_prediction_is_the_model_at_the_estimate(experiment, record):
    prediction = experiment.predict()
    x = prediction["x"]
    np.testing.assert_array_equal(prediction.time_s, record["t"])
    assert x.quantiles.shape == (1000, 3) and x.sample_quantiles.shape == (1000, 3)
    # The posterior contains the truth within four standard deviations, at every time.
    assert np.all(np.abs(x.mean - motion(TRUTH["k"], TRUTH["c"], record["t"]))
                  < 4 * x.std_dev + 1e-4)
    np.testing.assert_allclose(x.measured, record["x"])
    np.testing.assert_allclose(x.residual, x.measured - x.mean[x.measured_rows])
    np.testing.assert_allclose(x.standardized_residual, x.residual / x.sample_std_dev, rtol=1e-6)
    # Of 1000 samples, 95 % ± 4 √(0.95 · 0.05/1000) lie in the central 95 %.
    assert abs(x.score.coverage95 - 0.95) < 0.028
    assert x.score.sample_count == 1000 and len(x.score.autocorrelation) == 50
    frame = prediction.to_dataframe("x")
    assert frame["measured"].notna().sum() == 1000 and frame.index.name == "t"


def test_a_prediction_at_other_times_and_of_another_output(experiment):
    prediction = experiment.predict(["v"], times=[0.0, 1.0, 2.0], probabilities=[0.5], draws=100)
    assert prediction["v"].quantiles.shape == (3, 1)
    assert prediction["v"].sample_std_dev is None and prediction["v"].score is None
    assert prediction.draw_count == 100
    assert prediction["v"].unit == "m/s"


def test_a_record_that_was_held_out_is_scored(client, problem, rows):
    half = client.experiment(problem, rows(0, 500))
    held_out = half.predict(record=rows(500, 1000))
    assert held_out["x"].score.sample_count == 500
    assert abs(held_out["x"].score.coverage95 - 0.95) < 0.05


def test_a_posterior_has_samples_densities_and_quantiles(experiment):
    posterior = experiment.posterior(samples=2000, all_joints=True, probabilities=[0.1, 0.9])
    estimate = experiment.estimate()
    assert posterior.samples.shape == (2000, 2)
    assert list(posterior.parameters) == ["k", "c"]
    for column, name in enumerate(("k", "c")):
        # The mean of 2000 draws scatters by 1/√2000 of the standard deviation.
        error = posterior.samples[:, column].mean() - estimate[name].mean
        assert abs(error) < 0.15 * estimate[name].std_dev
        marginal = posterior[name]
        width = marginal.value[1] - marginal.value[0]
        assert marginal.density.sum() * width == pytest.approx(1.0, abs=0.02)
        assert marginal.quantiles.shape == (2,) and marginal.quantiles[0] < marginal.quantiles[1]
    joint = posterior.joints[0]
    assert joint.density.shape == (len(joint.first_value), len(joint.second_value))
    assert list(posterior.to_dataframe().columns) == ["k", "c"]


def test_profiles_have_their_minimum_at_the_estimate(experiment):
    profiles = experiment.profiles(points=21)
    estimate = experiment.estimate()
    for column, name in enumerate(profiles.parameters):
        profile = profiles[name]
        least = profile.value[np.argmin(profile.total)]
        assert abs(least - estimate[name].map) <= np.diff(profile.value).max()
        np.testing.assert_allclose(profile.minima[:, column], profile.value, rtol=1e-9)
        assert profile.converged.all()
        assert (profile.total >= profiles.least.total - 1e-6).all()
    frame = profiles.to_dataframe()
    assert len(frame) == 42 and list(frame["parameter"].unique()) == ["k", "c"]


def test_a_grid_of_costs_adds_up(experiment):
    grid = experiment.cost_grid(["c", "k"], points=9)
    assert grid.total.shape == (9, 9) and [axis.parameter for axis in grid.axes] == ["c", "k"]
    finite = np.isfinite(grid.total)
    np.testing.assert_allclose(grid.total[finite], (grid.mismatch + grid.prior)[finite])
    line = experiment.cost_grid(["k"], points=11, held={"c": 0.23})
    assert line.total.shape == (11,)
    frame = grid.to_dataframe()
    assert list(frame.columns) == ["c", "k", "mismatch", "prior", "total"]
    np.testing.assert_array_equal(frame["total"], grid.total.ravel())
    assert frame["c"].nunique() == 9 and frame["c"][0] == frame["c"][1] == grid.axes[0].value[0]


def test_a_sweep_of_regularization_offers_three_rules(experiment):
    sweep = experiment.regularization(points=5)
    assert set(sweep.choices) == {"L_CURVE", "DISCREPANCY", "EVIDENCE"}
    weights = [point.regularization for point in sweep.points]
    assert weights == sorted(weights) and sweep.points[0].map.shape == (2,)
    frame = sweep.to_dataframe()
    assert list(frame["parameter"][:2]) == ["k", "c"] and list(frame["unit"][:1]) == ["N/m"]
    assert list(frame["regularization"][::2]) == weights


def test_a_propagation_is_the_mean_of_the_prior(client, problem):
    propagation = client.experiment(problem).propagate(1.0, 0.1, probabilities=[0.5])
    # The mean over the uniform prior, by Gauss's rule with 20 × 20 points.
    nodes, weights = np.polynomial.legendre.leggauss(20)
    stiffness, damping = 39.48 + 7.896 * nodes, 0.2 + 0.1 * nodes
    mean = sum(one * other / 4 * motion(k, c, propagation.time_s)
               for one, k in zip(weights, stiffness) for other, c in zip(weights, damping))
    # The expansion has order 3; its error is bounded by the residual that it reports.
    bound = 3 * propagation["x"].residual.max() + 1e-6
    np.testing.assert_allclose(propagation["x"].mean, mean, atol=bound)
    assert propagation["x"].quantiles.shape == (11, 1)
    frame = propagation.to_dataframe("x")
    assert list(frame.columns) == ["mean", "std_dev", "q0.5", "residual"]
    assert frame.index.name == "t" and len(frame) == 11


def test_sensitivities_are_shares(client, problem):
    sensitivity = client.experiment(problem).sensitivity(2.0, draws=64)
    x = sensitivity["x"]
    assert x.total.shape == (len(sensitivity.time_s), 2) == x.first_order.shape
    assert (x.total >= x.first_order - 1e-9).all() and (x.total <= 1 + 1e-9).all()
    assert sensitivity.draw_count == 64
    # The stiffness shifts the phase by far more than the damping changes the amplitude.
    assert next(iter(sensitivity.activity)) == "k"
    frame = sensitivity.to_dataframe("x")
    assert list(frame["parameter"][:2]) == ["k", "c"]
    np.testing.assert_array_equal(frame["total"], x.total.ravel())


def test_a_design_ranks_experiments(client):
    wanted = (polyest.Problem.builtin("mass_spring_damper").fix(m=1.0)
              .uncertain("k", polyest.Uniform(30, 50)).measure("x", noise=0.01))
    design = client.experiment(wanted).design(
        4.0, samples=3, candidates={"push": {"force": polyest.Constant(1.0)},
                                    "shove": {"force": polyest.Constant(10.0)}},
        outputs={"a": 1.0})
    assert design.best.name == "shove"
    assert [one.gain.bits for one in design.candidates] == sorted(
        (one.gain.bits for one in design.candidates), reverse=True)
    assert len(design.best.samples) <= 3 and design.best.outputs["a"].noise_std_dev == 1.0
    assert "shove" in design._repr_html_()
    frame = design.to_dataframe()
    assert set(frame["candidate"]) == {"push", "shove"} and set(frame["output"]) == {"x", "a"}


def test_a_history_of_a_record_narrows(experiment):
    history = experiment.history(5)
    assert len(history) >= 5
    assert history.points[-1].parameters["k"].std_dev < history.points[0].parameters["k"].std_dev


def test_models_are_described(client):
    models = client.models()
    model = client.model("mass_spring_damper")
    assert models["mass_spring_damper"] == model
    assert model.parameters["k"].unit == "N/m" and "x" in model.outputs
    assert "N/m" in model._repr_html_()
    with pytest.raises(polyest.NotFound):
        client.model("perpetual_motion")


def test_the_daemon_tells_its_version(client):
    status = client.status()
    assert status.version and status.memory_bytes > 0 and status.uptime_s >= 0


@pytest.mark.parametrize(("call", "argument", "said"), [
    (lambda one: one.predict(draws=2.5), "draws", "2.5 of the type float must be a whole number"),
    (lambda one: one.predict(outputs=5), "outputs", "5 of the type int must be a list, of which "),
    (lambda one: one.predict(times="now"), "times", "'now' of the type str must be numbers"),
    (lambda one: one.predict(horizon_s="1 s"), "horizon_s", "must be a number"),
    (lambda one: one.posterior(samples="10"), "samples", "must be a whole number below 2^31"),
    (lambda one: one.posterior(samples=2**40), "samples", "must be a whole number below 2^31"),
    (lambda one: one.posterior(joints=[("k",)]), "joints", "must be a pair of names"),
    (lambda one: one.posterior(probabilities=0.5), "probabilities", "must be a list, of which "),
    (lambda one: one.profiles(points=None, parameters=[1]), "parameters", "each is a text"),
    (lambda one: one.cost_grid(held={"c": "big"}), "held", "must be a dict of numbers"),
    (lambda one: one.cost_grid(held=5), "held", "must be a dict of numbers"),
    (lambda one: one.propagate("1", 0.1), "until_s", "must be a number"),
    (lambda one: one.design(1.0, candidates=["push"]), "candidates", "must be a dict"),
    (lambda one: one.design(1.0, outputs={"a": "loud"}), "outputs.a", "must be a number"),
    (lambda one: one.history("all"), "points", "must be a whole number"),
])
def test_an_argument_of_a_wrong_type_is_named(experiment, call, argument, said):
    with pytest.raises(polyest.InvalidInput) as raised:
        call(experiment)
    assert isinstance(raised.value, TypeError) and raised.value.field == argument
    assert raised.value.message.startswith(f"{argument}: ") and said in raised.value.message


def test_one_name_stands_for_a_list_of_it(experiment):
    assert list(experiment.profiles("k", points=5).profiles) == ["k"]
