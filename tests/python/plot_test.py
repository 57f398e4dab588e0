"""Pictures have the numbers of the results, with labels and units."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import polyest
from polyest import plot


@pytest.fixture(scope="module")
def experiment(client, record):
    """The oscillator with its record."""
    wanted = (polyest.Problem.builtin("mass_spring_damper").fix(m=1.0, x0=1.0)
              .uncertain("k", polyest.Uniform(31.584, 47.376))
              .uncertain("c", polyest.Uniform(0.1, 0.3)).measure("x", noise=0.01))
    return client.experiment(wanted, record)


@pytest.fixture(autouse=True)
def drawn(tmp_path):
    """Every figure that is open at the end can be written, and is closed."""
    yield
    for number in plt.get_fignums():
        plt.figure(number).savefig(tmp_path / f"{number}.png", dpi=40)
    plt.close("all")


def lines_of(axis):
    return [line.get_xydata() for line in axis.get_lines()]


def test_a_fit_has_samples_mean_and_two_bands(experiment):
    prediction = experiment.predict(draws=50)
    axis = plot.fit(prediction).axes[0]
    mean, measured = lines_of(axis)
    np.testing.assert_array_equal(mean[:, 1], prediction["x"].mean)
    np.testing.assert_array_equal(measured[:, 1], prediction["x"].measured)
    assert len(axis.collections) == 2
    assert (axis.get_xlabel(), axis.get_ylabel()) == ("t [s]", "x [m]")
    labels = [text.get_text() for text in axis.get_legend().get_texts()]
    assert "95 % of new samples" in labels and "95 % of the prediction" in labels


def test_an_output_that_is_not_measured_has_one_band(experiment):
    axis = experiment.predict(["v"], draws=50).plot().axes[0]
    assert len(axis.collections) == 1 and axis.get_ylabel() == "v [m/s]"


def test_runs_have_columns_of_their_own(client, record):
    wanted = (polyest.Problem.builtin("mass_spring_damper").fix(m=1.0, x0=1.0)
              .uncertain("k", polyest.Uniform(31.584, 47.376)).fix(c=0.23).measure("x", 0.01))
    twice = {"t": np.tile(record["t"][:100], 2), "x": np.tile(record["x"][:100], 2),
             "run": np.repeat([0, 1], 100)}
    figure = client.experiment(wanted, twice).predict(draws=20).plot()
    assert [axis.get_xlabel() for axis in figure.axes] == ["t of run 0 [s]", "t of run 1 [s]"]
    assert all(len(lines_of(axis)[1]) == 100 for axis in figure.axes)


def test_residuals_are_standardized_beside_their_autocorrelation(experiment):
    estimate = experiment.estimate()
    left, right = estimate.plot_residuals(draws=50).axes
    values = lines_of(left)[0][:, 1]
    assert abs(np.std(values) - 1) < 0.1 and left.get_ylabel() == "residual of x / sd"
    assert right.get_ylabel() == "autocorrelation"
    assert len(right.collections[0].get_segments()) == 50


def test_a_history_has_a_panel_for_each_parameter(experiment):
    history = experiment.history(4)
    figure = history.plot()
    assert [axis.get_ylabel() for axis in figure.axes] == ["k [N/m]", "c [N s/m]"]
    np.testing.assert_array_equal(
        lines_of(figure.axes[0])[0][:, 1],
        [point.parameters["k"].mean for point in history.points])
    assert len(experiment.estimate().plot_history().axes) == 2


def test_an_estimate_shows_prior_and_posterior(experiment):
    figure = experiment.estimate().plot()
    prior, posterior = figure.axes[0].patches
    assert posterior.get_width() < prior.get_width()
    assert figure.axes[0].get_xlabel() == "identified [N/m]"


def test_a_corner_plot_has_marginals_and_joints(experiment):
    figure = experiment.estimate().plot_corner()
    diagonal, upper, joint, _ = figure.axes
    assert len(diagonal.get_lines()) == 1 and not upper.axison
    assert len(joint.collections) > 0
    assert (joint.get_xlabel(), joint.get_ylabel()) == ("k [N/m]", "c [N s/m]")


def test_profiles_begin_at_the_least_cost(experiment):
    figure = experiment.profiles(points=15).plot()
    for axis in figure.axes:
        # The points are about half a standard deviation apart: the nearest one costs little.
        assert -1e-9 < lines_of(axis)[0][:, 1].min() < 0.2


def test_costs_are_contours_or_a_curve(experiment):
    contours = experiment.cost_grid(points=11).plot()
    assert contours.axes[0].get_xlabel() == "k [N/m]"
    curve = experiment.cost_grid(["c"], points=11).plot()
    assert lines_of(curve.axes[0])[0][:, 1].min() == 0


def test_studies_of_the_prior_are_drawn(experiment):
    band = experiment.propagate(2.0, 0.1).plot()
    assert band.axes[0].get_ylabel() == "x [m]"
    shares = experiment.sensitivity(2.0).plot()
    assert [line.get_label() for line in shares.axes[0].get_lines()] == ["k", "c"]


def test_an_l_curve_has_its_points(experiment):
    sweep = experiment.regularization(points=5)
    assert len(lines_of(sweep.plot().axes[0])[0]) == len(sweep.points)
