"""Answers of studies: arrays with names and units."""

from polyest.results.convergence import Convergence, ParameterConvergence
from polyest.results.cost import (
    Axis,
    Choice,
    CostGrid,
    CostProfile,
    CostProfiles,
    RegularizationPoint,
    RegularizationSweep,
)
from polyest.results.design import DesignCandidate, DesignOutput, ExperimentDesign, Gain
from polyest.results.history import History, HistoryPoint, ParameterThen
from polyest.results.posterior import Joint, Marginal, Posterior
from polyest.results.prediction import AbruptChange, PredictedOutput, Prediction, Score
from polyest.results.prior import (
    ExpansionUsed,
    Propagation,
    PropagationOutput,
    Sensitivity,
    SensitivityOutput,
)

__all__ = [
    "AbruptChange", "Axis", "Choice", "Convergence", "CostGrid", "CostProfile", "CostProfiles",
    "DesignCandidate", "DesignOutput", "ExpansionUsed", "ExperimentDesign", "Gain", "History",
    "HistoryPoint", "Joint", "Marginal", "ParameterConvergence", "ParameterThen", "Posterior",
    "PredictedOutput", "Prediction", "Propagation", "PropagationOutput", "RegularizationPoint",
    "RegularizationSweep", "Score", "Sensitivity", "SensitivityOutput",
]
